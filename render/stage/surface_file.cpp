#include "render/stage/surface_file.h"

namespace surflect {

using Vector = Vec3<double>;
using Direction = Direction3<AcquisitionSpace, double>;

namespace {

Direction roundTheAxis(const Direction& normal) { return Direction(-normal.raw().y(), normal.raw().x(), 0); }

// Every corner becomes a vertex.
TriangleMesh unshared(const TriangleMesh& mesh) {
  TriangleMesh corners;
  for (const auto& triangle : mesh.triangles) {
    const auto first = static_cast<uint32_t>(corners.positions.size());
    for (const uint32_t vertex : triangle) corners.positions.push_back(mesh.positions[vertex]);
    corners.triangles.push_back({first, first + 1, first + 2});
  }
  return corners;
}

} // namespace

Surface readSurface(const std::filesystem::path& path, bool smooth) {
  Surface surface;
  const TriangleMesh mesh = readMesh(path);
  surface.mesh = smooth ? mesh : unshared(mesh);
  std::vector<Vector> sums(surface.mesh.positions.size(), Vector::Zero());
  for (size_t i = 0; i < surface.mesh.triangles.size(); ++i)
    for (const uint32_t vertex : surface.mesh.triangles[i]) sums[vertex] += areaVector(surface.mesh, i);
  for (const Vector& sum : sums) {
    surface.normals.push_back(assume<Direction>(sum.stableNormalized()));
    surface.tangents.push_back(roundTheAxis(surface.normals.back()));
  }
  return surface;
}

} // namespace surflect
