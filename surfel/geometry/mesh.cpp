#include "surfel/geometry/mesh.h"

#include "surfel/base/error.h"
#include "surfel/geometry/obj.h"
#include "surfel/geometry/ply.h"

#include <algorithm>
#include <string>

namespace surflect {

Vec3<double> areaVector(const TriangleMesh& mesh, size_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  const Vec3<double> pa = mesh.positions[a].cast<double>().raw();
  return (mesh.positions[b].cast<double>().raw() - pa).cross(mesh.positions[c].cast<double>().raw() - pa);
}

double surfaceArea(const TriangleMesh& mesh) {
  double area = 0;
  for (size_t t = 0; t < mesh.triangles.size(); ++t) area += areaVector(mesh, t).norm() / 2;
  return area;
}

TriangleMesh readMeshAsStored(const std::filesystem::path& path, const MeshReading& reading,
                              const Progress& progress) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? c + 32 : c; });
  if (extension == ".obj") return readObj(path, reading, progress);
  if (extension == ".ply" || extension.empty()) return readPlyMesh(path, reading, progress);
  throw Error::mismatch("a mesh as .ply or .obj", extension).in(path);
}

TriangleMesh withoutFlat(TriangleMesh mesh, const Progress& progress) {
  TriangleMesh solid{std::move(mesh.positions), {}};
  for (const auto& triangle : mesh.triangles) {
    progress.checkNowAndThen(solid.triangles.size());
    solid.triangles.push_back(triangle);
    if (!(areaVector(solid, solid.triangles.size() - 1).norm() > 0)) solid.triangles.pop_back();
  }
  if (solid.triangles.empty()) throw Error::mismatch("triangles", "none that has an area");
  return solid;
}

TriangleMesh withoutUnused(TriangleMesh mesh) {
  constexpr uint32_t kUnused = ~0u;
  std::vector<uint32_t> places(mesh.positions.size(), kUnused);
  for (const auto& triangle : mesh.triangles)
    for (const uint32_t corner : triangle) places[corner] = 0;
  uint32_t used = 0;
  for (size_t i = 0; i < places.size(); ++i) {
    if (places[i] == kUnused) continue;
    mesh.positions[used] = mesh.positions[i];
    places[i] = used++;
  }
  mesh.positions.resize(used);
  for (auto& triangle : mesh.triangles)
    for (uint32_t& corner : triangle) corner = places[corner];
  return mesh;
}

TriangleMesh readMesh(const std::filesystem::path& path, const MeshReading& reading,
                      const Progress& progress) {
  TriangleMesh stored = readMeshAsStored(path, reading, progress);
  try {
    return withoutUnused(withoutFlat(std::move(stored), progress));
  } catch (Error& error) {
    throw std::move(error).in(path);
  }
}

} // namespace surflect
