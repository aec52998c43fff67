#include "render/stage/grid_mesh.h"

namespace surflect::stage {

void addGridMesh(Surface& surface, int columns, int rows,
                 const std::function<SurfacePoint(double s, double t)>& point) {
  using Direction = Direction3<AcquisitionSpace, double>;
  auto& triangles = surface.mesh.triangles;
  requireFewTriangles(triangles.size() + 2 * static_cast<size_t>(columns) * static_cast<size_t>(rows));
  const auto first = static_cast<uint32_t>(surface.mesh.positions.size());
  for (int row = 0; row <= rows; ++row)
    for (int column = 0; column <= columns; ++column) {
      const SurfacePoint p = point(static_cast<double>(column) / columns, static_cast<double>(row) / rows);
      surface.textureCoordinates.push_back(p.st);
      surface.mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(p.position));
      surface.normals.push_back(assume<Direction>(p.normal));
      surface.tangents.push_back(assume<Direction>(p.tangent));
    }
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const uint32_t a = first + static_cast<uint32_t>(row * (columns + 1) + column), b = a + 1,
                     d = a + static_cast<uint32_t>(columns + 1), c = d + 1;
      for (const auto& triangle : {std::array{a, b, c}, std::array{a, c, d}}) {
        triangles.push_back(triangle);
        if (!(areaVector(surface.mesh, triangles.size() - 1).norm() > 0)) triangles.pop_back();
      }
    }
}

} // namespace surflect::stage
