#include "surfel/geometry/ply_mesh.h"

#include "surfel/base/error.h"
#include "surfel/geometry/ply.h"

#include <optional>
#include <string>

namespace surflect {

namespace {

uint32_t vertexIndex(double value, size_t vertices, size_t item) {
  if (!(value >= 0) || value >= static_cast<double>(vertices))
    throw Error::mismatch("an index below " + std::to_string(vertices), std::to_string(value))
        .at("[" + std::to_string(item) + "]");
  return static_cast<uint32_t>(value);
}

bool hasScalar(const PlyElement& element, const char* name) {
  const PlyProperty* property = element.find(name);
  return property && !property->isList;
}

void addPositions(const PlyElement& vertices, const Vec3<double>& origin, FaceList& list,
                  const Progress& progress) {
  const auto x = vertices.scalars("x"), y = vertices.scalars("y"), z = vertices.scalars("z");
  for (size_t i = 0; i < vertices.count; ++i) {
    progress.checkNowAndThen(i);
    list.positions.push_back(assume<Point3<AcquisitionSpace>>(
        Vec3<float>((Vec3<double>(x[i], y[i], z[i]) - origin).cast<float>())));
    if (!list.positions.back().raw().allFinite())
      throw Error::mismatch("finite coordinates",
                            numberText(x[i]) + ' ' + numberText(y[i]) + ' ' + numberText(z[i]))
          .at("vertex[" + std::to_string(i) + "]");
  }
}

// Adds texture coordinates by any of their usual names.
void addTextureCoordinates(const PlyElement& vertices, FaceList& list) {
  for (const auto& [s, t] : {std::pair{"s", "t"}, std::pair{"u", "v"}, std::pair{"texture_u", "texture_v"}}) {
    if (!hasScalar(vertices, s) || !hasScalar(vertices, t)) continue;
    const auto first = vertices.scalars(s), second = vertices.scalars(t);
    for (size_t i = 0; i < vertices.count; ++i) {
      list.textureCoordinates.emplace_back(first[i], second[i]);
      if (!list.textureCoordinates.back().allFinite())
        throw Error::mismatch("finite texture coordinates",
                              numberText(first[i]) + ' ' + numberText(second[i]))
            .at("vertex[" + std::to_string(i) + "]");
    }
    return;
  }
}

void addNormals(const PlyElement& vertices, FaceList& list) {
  if (!hasScalar(vertices, "nx") || !hasScalar(vertices, "ny") || !hasScalar(vertices, "nz")) return;
  const auto x = vertices.scalars("nx"), y = vertices.scalars("ny"), z = vertices.scalars("nz");
  for (size_t i = 0; i < vertices.count; ++i) {
    const Vec3<double> normal(x[i], y[i], z[i]);
    list.normals.push_back(normal.allFinite() ? normal : Vec3<double>(0, 0, 0));
  }
}

// Adds a face's texture coordinates, two numbers per corner; none if the face has none. Returns the index of
// the first.
std::optional<uint32_t> addFaceCoordinates(const PlyProperty* property, size_t face, size_t corners,
                                           FaceList& list) {
  const size_t first = property ? property->start[face] : 0,
               count = property ? property->start[face + 1] - first : 0;
  if (count == 0) return std::nullopt;
  if (count != 2 * corners)
    throw Error::mismatch(std::to_string(2 * corners) + " numbers, two a corner", std::to_string(count))
        .at("texcoord")
        .at("[" + std::to_string(face) + "]");
  const auto place = static_cast<uint32_t>(list.textureCoordinates.size());
  for (size_t i = first; i < first + count; i += 2) {
    list.textureCoordinates.emplace_back(property->values[i], property->values[i + 1]);
    if (!list.textureCoordinates.back().allFinite())
      throw Error::mismatch("finite numbers", "others").at("texcoord").at("[" + std::to_string(face) + "]");
  }
  return place;
}

void addFaces(const PlyElement& element, const PlyProperty& lists, bool wantsAll, FaceList& list,
              const Progress& progress) {
  const PlyProperty* coordinates = wantsAll ? element.find("texcoord") : nullptr;
  if (coordinates && !coordinates->isList) coordinates = nullptr;
  const bool haveTexture = !list.textureCoordinates.empty(), haveNormals = !list.normals.empty();
  for (size_t f = 0; f + 1 < lists.start.size(); ++f) {
    progress.checkNowAndThen(f);
    const size_t first = lists.start[f], corners = lists.start[f + 1] - first;
    if (corners < 3) continue;
    const std::optional<uint32_t> ofFace = addFaceCoordinates(coordinates, f, corners, list);
    for (uint32_t i = 0; i < corners; ++i) {
      const uint32_t vertex = vertexIndex(lists.values[first + i], list.positions.size(), f);
      list.corners.push_back({vertex,
                              ofFace        ? *ofFace + i
                              : haveTexture ? vertex
                                            : FaceList::kNone,
                              haveNormals ? vertex : FaceList::kNone});
    }
    list.endFace();
  }
}

// Adds triangle strips; the winding alternates, -1 starts a new strip.
void addStrips(const PlyElement&, const PlyProperty& lists, bool, FaceList& list, const Progress& progress) {
  const bool haveTexture = !list.textureCoordinates.empty(), haveNormals = !list.normals.empty();
  for (size_t s = 0; s + 1 < lists.start.size(); ++s) {
    std::vector<FaceList::Corner> strip;
    for (size_t i = lists.start[s]; i < lists.start[s + 1]; ++i) {
      if (lists.values[i] == -1) {
        strip.clear();
        continue;
      }
      progress.checkNowAndThen(i);
      const uint32_t vertex = vertexIndex(lists.values[i], list.positions.size(), s);
      strip.push_back(
          {vertex, haveTexture ? vertex : FaceList::kNone, haveNormals ? vertex : FaceList::kNone});
      const size_t n = strip.size();
      if (n < 3) continue;
      const auto a = strip[n - 3], b = strip[n - 2];
      list.corners.insert(list.corners.end(), {n % 2 ? a : b, n % 2 ? b : a, strip[n - 1]});
      list.endFace();
    }
  }
}

// Texture coordinates and normals only if wanted.
FaceList readFaces(const std::filesystem::path& path, bool wantsAll, const Vec3<double>& origin,
                   const Progress& progress) {
  const PlyFile ply = readPly(path, progress);
  try {
    FaceList list;
    const PlyElement* vertices = ply.find("vertex");
    if (!vertices) throw Error::mismatch("an element 'vertex'", "none");
    addPositions(*vertices, origin, list, progress);
    if (wantsAll) {
      addTextureCoordinates(*vertices, list);
      addNormals(*vertices, list);
    }
    for (const auto& [element, add] : {std::pair{"face", &addFaces}, std::pair{"tristrips", &addStrips}})
      if (const PlyElement* found = ply.find(element))
        for (const char* name : {"vertex_indices", "vertex_index"})
          if (const PlyProperty* lists = found->find(name); lists && lists->isList) {
            try {
              add(*found, *lists, wantsAll, list, progress);
            } catch (Error& error) {
              throw std::move(error).at(element);
            }
          }
    return list;
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

} // namespace

TriangleMesh readPlyMesh(const std::filesystem::path& path, const MeshReading& reading,
                         const Progress& progress) {
  return meshOf(readFaces(path, false, reading.origin, progress), reading.faces, progress);
}

TexturedMesh readTexturedPly(const std::filesystem::path& path, const Progress& progress) {
  return texturedMeshOf(readFaces(path, true, {0, 0, 0}, progress), Faces::cut, progress);
}

} // namespace surflect
