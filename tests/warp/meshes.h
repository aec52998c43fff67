// Meshes for tests of mesh-driven warps.
#pragma once

#include "surfel/geometry/mesh.h"
#include "warp/mesh_field.h"

#include <cmath>
#include <fstream>
#include <numbers>

namespace surflect::warp {

// A torus about z, of radii 0.6 and 0.25, with `around` times `through` quads, all split the same way.
inline Vec3<double> torusPoint(double u, double v, double radius = 0.25) {
  u *= 2 * std::numbers::pi;
  v *= 2 * std::numbers::pi;
  const double ring = 0.6 + radius * std::cos(v);
  return {ring * std::cos(u), ring * std::sin(u), radius * std::sin(v)};
}
inline TriangleMesh torus(int around, int through) {
  TriangleMesh mesh;
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < through; ++j) {
      const auto at = [&](int a, int b) {
        return static_cast<uint32_t>((i + a) % around * through + (j + b) % through);
      };
      mesh.positions.push_back(
          assume<Point3<AcquisitionSpace>>(torusPoint(double(i) / around, double(j) / through)));
      mesh.triangles.push_back({at(0, 0), at(1, 0), at(1, 1)});
      mesh.triangles.push_back({at(0, 0), at(1, 1), at(0, 1)});
    }
  return mesh;
}

inline std::vector<Vec3<double>> positionsOf(const TriangleMesh& mesh) {
  std::vector<Vec3<double>> positions;
  for (const auto& p : mesh.positions) positions.push_back(p.raw().cast<double>());
  return positions;
}

inline MeshField fieldOf(const TriangleMesh& mesh) { return MeshField(positionsOf(mesh), mesh.triangles); }

inline void writeObj(const std::filesystem::path& path, const TriangleMesh& mesh) {
  std::ofstream file(path);
  file.precision(9);
  for (const auto& p : mesh.positions) file << "v " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  for (const auto& t : mesh.triangles) file << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
}

} // namespace surflect::warp
