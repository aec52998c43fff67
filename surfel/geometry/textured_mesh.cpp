#include "surfel/geometry/textured_mesh.h"

#include "surfel/geometry/ear_clipping.h"

#include <algorithm>
#include <map>
#include <span>

namespace surflect {

namespace {

using Corner = FaceList::Corner;

// Calls add(a, b, c) for every triangle, with indices of corners in the list.
template <class Add>
void forEachTriangle(const FaceList& list, Faces faces, const Progress& progress, const Add& add) {
  std::vector<Vec3<double>> places;
  std::vector<std::array<uint32_t, 3>> cut;
  for (size_t f = 0; f < list.faceCount(); ++f) {
    progress.checkNowAndThen(f);
    const size_t first = list.start[f], end = list.start[f + 1];
    if (faces == Faces::asFans || end - first == 3) {
      for (size_t i = first + 2; i < end; ++i) add(first, i - 1, i);
      continue;
    }
    places.clear();
    cut.clear();
    for (size_t i = first; i < end; ++i)
      places.push_back(list.positions[list.corners[i].vertex].cast<double>().raw());
    appendTriangles(places, cut, progress);
    for (const auto& [a, b, c] : cut) add(first + a, first + b, first + c);
  }
}

// Appends the corners of a face; drops attributes that some of them lack.
void appendCorners(std::span<const Corner> face, std::vector<Corner>& corners) {
  const auto allHave = [&](uint32_t Corner::*what) {
    return std::ranges::none_of(face, [&](const Corner& corner) { return corner.*what == FaceList::kNone; });
  };
  const bool allHaveTexture = allHave(&Corner::texture), allHaveNormal = allHave(&Corner::normal);
  for (Corner corner : face) {
    if (!allHaveTexture) corner.texture = FaceList::kNone;
    if (!allHaveNormal) corner.normal = FaceList::kNone;
    corners.push_back(corner);
  }
}

} // namespace

TriangleMesh meshOf(FaceList list, Faces faces, const Progress& progress) {
  TriangleMesh mesh;
  const auto vertex = [&](size_t corner) { return list.corners[corner].vertex; };
  forEachTriangle(list, faces, progress, [&](size_t a, size_t b, size_t c) {
    mesh.triangles.push_back({vertex(a), vertex(b), vertex(c)});
  });
  mesh.positions = std::move(list.positions);
  return mesh;
}

TexturedMesh texturedMeshOf(const FaceList& list, Faces faces, const Progress& progress) {
  std::vector<Corner> corners;
  for (size_t f = 0; f < list.faceCount(); ++f) {
    progress.checkNowAndThen(f);
    appendCorners(std::span(list.corners).subspan(list.start[f], list.start[f + 1] - list.start[f]), corners);
  }
  const auto anyHas = [&](uint32_t Corner::*what) {
    return std::ranges::any_of(corners,
                               [&](const Corner& corner) { return corner.*what != FaceList::kNone; });
  };
  const bool hasTexture = anyHas(&Corner::texture), hasNormals = anyHas(&Corner::normal);
  TexturedMesh textured;
  std::map<Corner, uint32_t> vertices;
  const auto vertexOf = [&](size_t index) {
    const Corner& corner = corners[index];
    const auto [found, isNew] = vertices.try_emplace(corner, static_cast<uint32_t>(textured.corner.size()));
    if (isNew) {
      textured.mesh.positions.push_back(list.positions[corner.vertex]);
      textured.corner.push_back(corner.vertex);
      if (hasTexture)
        textured.textureCoordinates.push_back(
            corner.texture == FaceList::kNone ? Vec2<double>(0, 0) : list.textureCoordinates[corner.texture]);
      if (hasNormals)
        textured.normals.push_back(corner.normal == FaceList::kNone ? Vec3<double>(0, 0, 0)
                                                                    : list.normals[corner.normal]);
    }
    return found->second;
  };
  forEachTriangle(list, faces, progress, [&](size_t a, size_t b, size_t c) {
    const uint32_t va = vertexOf(a), vb = vertexOf(b),
                   vc = vertexOf(c); // evaluated in this order, which numbers the vertices
    textured.mesh.triangles.push_back({va, vb, vc});
  });
  return textured;
}

} // namespace surflect
