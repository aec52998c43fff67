#include "render/stage/surface_file.h"

#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "surfel/base/hash.h"
#include "surfel/geometry/obj.h"
#include "surfel/geometry/ply_mesh.h"
#include "warp/gltf.h"

#include <algorithm>
#include <string>

namespace surflect::stage {

using Vector = Vec3<double>;
using Direction = Direction3<AcquisitionSpace, double>;

namespace {

struct MeshFile {
  TexturedMesh mesh;
  uint64_t hash;
};

MeshFile readTexturedMesh(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  if (extension == ".gltf" || extension == ".glb") {
    warp::GltfMesh file = warp::readGltfMesh(path);
    return {std::move(file.mesh), file.contentHash};
  }
  const std::string bytes = readFile(path);
  const uint64_t hash = contentHash(std::as_bytes(std::span(bytes)));
  if (extension == ".obj") return {readTexturedObj(path), hash};
  if (extension == ".ply" || extension.empty()) return {readTexturedPly(path), hash};
  throw Error::mismatch("a mesh as .ply, .obj, .gltf or .glb", extension).in(path);
}

void removeFlatTriangles(TriangleMesh& mesh, const std::filesystem::path& path) {
  const TriangleMesh stored = mesh;
  mesh.triangles.clear();
  for (size_t i = 0; i < stored.triangles.size(); ++i)
    if (areaVector(stored, i).norm() > 0) mesh.triangles.push_back(stored.triangles[i]);
  if (mesh.triangles.empty()) throw Error::mismatch("triangles", "none that has an area").in(path);
}

// Flips triangles whose corner normals all point to the back: exporters mirror triangles without their
// normals.
void windByNormals(TexturedMesh& mesh) {
  if (mesh.normals.empty()) return;
  for (size_t i = 0; i < mesh.mesh.triangles.size(); ++i) {
    const Vector area = areaVector(mesh.mesh, i);
    auto& triangle = mesh.mesh.triangles[i];
    if (std::ranges::all_of(triangle, [&](uint32_t v) { return mesh.normals[v].dot(area) < 0; }))
      std::swap(triangle[1], triangle[2]);
  }
}

// Mesh with separate vertices for each triangle.
TexturedMesh unshared(const TexturedMesh& mesh) {
  TexturedMesh apart;
  for (const auto& triangle : mesh.mesh.triangles) {
    const auto first = static_cast<uint32_t>(apart.mesh.positions.size());
    for (const uint32_t vertex : triangle) {
      apart.corner.push_back(static_cast<uint32_t>(apart.corner.size()));
      apart.mesh.positions.push_back(mesh.mesh.positions[vertex]);
      if (!mesh.textureCoordinates.empty())
        apart.textureCoordinates.push_back(mesh.textureCoordinates[vertex]);
    }
    apart.mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return apart;
}

std::vector<Vector> meanNormals(const TexturedMesh& mesh) {
  std::vector<Vector> sums(1 + static_cast<size_t>(*std::ranges::max_element(mesh.corner)), Vector::Zero());
  for (size_t i = 0; i < mesh.mesh.triangles.size(); ++i)
    for (const uint32_t vertex : mesh.mesh.triangles[i])
      sums[mesh.corner[vertex]] += areaVector(mesh.mesh, i);
  std::vector<Vector> normals;
  for (const uint32_t corner : mesh.corner) normals.push_back(sums[corner]);
  return normals;
}

// Twice the area times dp/ds, with p the triangle's map from its texture. For edges d, e with texture
// differences, d = ds p_s + dt p_t, so d e_t - e d_t = (d_s e_t - e_s d_t) p_s. Mirrored textures flip the
// sign; 0 without such a direction.
Vector alongTexture(const TexturedMesh& mesh, const std::array<uint32_t, 3>& triangle) {
  const auto& [a, b, c] = triangle;
  const auto edge = [&](uint32_t to) -> Vector {
    return mesh.mesh.positions[to].cast<double>().raw() - mesh.mesh.positions[a].cast<double>().raw();
  };
  const auto& st = mesh.textureCoordinates;
  const Vec2<double> d = st[b] - st[a], e = st[c] - st[a];
  const double determinant = d.x() * e.y() - e.x() * d.y();
  if (!(std::abs(determinant) > 0)) return Vector::Zero();
  return (determinant < 0 ? -1. : 1.) * (e.y() * edge(b) - d.y() * edge(c));
}

// Replaces vectors by the file's, where it has any.
void replaceByThoseThere(std::vector<Vector>& vectors, const std::vector<Vector>& ofFile) {
  for (size_t i = 0; i < ofFile.size(); ++i)
    if (ofFile[i].squaredNorm() > 0) vectors[i] = ofFile[i];
}

std::vector<Vector> meanTangents(const TexturedMesh& mesh) {
  std::vector<Vector> sums(mesh.mesh.positions.size(), Vector::Zero());
  if (mesh.textureCoordinates.empty()) return sums;
  for (const auto& triangle : mesh.mesh.triangles) {
    const Vector along = alongTexture(mesh, triangle);
    for (const uint32_t vertex : triangle) sums[vertex] += along;
  }
  return sums;
}

} // namespace

SurfaceFile readSurface(const std::filesystem::path& path, bool smooth) {
  auto [mesh, hash] = readTexturedMesh(path);
  removeFlatTriangles(mesh.mesh, path);
  windByNormals(mesh);
  if (!smooth) mesh = unshared(mesh);
  std::vector<Vector> normals = meanNormals(mesh), tangents = meanTangents(mesh);
  replaceByThoseThere(normals, mesh.normals);
  replaceByThoseThere(tangents, mesh.tangents);
  Surface surface;
  for (size_t i = 0; i < normals.size(); ++i) {
    const Vector n = normals[i].stableNormalized(), t = tangents[i] - tangents[i].dot(n) * n;
    const Vector roundTheAxis(-n.y(), n.x(), 0);
    surface.normals.push_back(assume<Direction>(n));
    surface.tangents.push_back(assume<Direction>(t.norm() > 0 ? t.stableNormalized() : roundTheAxis));
  }
  surface.textureCoordinates = std::move(mesh.textureCoordinates);
  surface.mesh = std::move(mesh.mesh);
  return {std::move(surface), hash};
}

} // namespace surflect::stage
