#include "render/lightfield/lumigraph/depth_geometry.h"

#include "surfel/geometry/ray_caster.h"
#include "surfel/geometry/simplify.h"
#include "surfel/math/bounds.h"

#include <cstdint>
#include <vector>

namespace surflect::lumigraph {

namespace {

// Area-weighted normals of vertices; 0 where there is none.
std::vector<Vec3<double>> vertexNormals(const TriangleMesh& mesh) {
  std::vector<Vec3<double>> normals(mesh.positions.size(), Vec3<double>::Zero());
  for (size_t t = 0; t < mesh.triangles.size(); ++t)
    for (const uint32_t corner : mesh.triangles[t]) normals[corner] += areaVector(mesh, t);
  for (Vec3<double>& normal : normals)
    if (const double length = normal.norm(); length > 0) normal /= length;
  return normals;
}

} // namespace

DepthGeometry depthGeometry(const TriangleMesh& object, size_t triangles) {
  if (triangles == 0 || triangles >= object.triangles.size()) return {object, {}, true};
  DepthGeometry geometry{simplified(object, triangles), {}, false};
  geometry.fringe = fringeAround(object, geometry.mesh);
  return geometry;
}

TriangleMesh fringeAround(const TriangleMesh& object, const TriangleMesh& simplified) {
  const double farthest = boundsOf(object.positions).diagonal().norm() / 10;
  const RayCaster<AcquisitionSpace> rays(simplified);
  const std::vector<Vec3<double>> outwards = vertexNormals(object), directions = vertexNormals(simplified);
  struct Heights {
    double sum = 0, count = 0;
  };
  std::vector<Heights> heights(simplified.positions.size()); // above the triangles of each vertex
  for (size_t i = 0; i < object.positions.size(); ++i) {
    if (outwards[i].isZero(0)) continue;
    const auto inwards = assume<Direction3<AcquisitionSpace, double>>(Vec3<double>(-outwards[i]));
    const auto hit = rays.firstHit(object.positions[i].cast<double>(), inwards);
    if (!hit || hit->distance > farthest) continue;
    const double cosine = areaVector(simplified, hit->triangle).normalized().dot(outwards[i]);
    if (!(cosine > 0)) continue;
    for (const uint32_t corner : simplified.triangles[hit->triangle])
      heights[corner].sum += hit->distance * cosine, heights[corner].count += 1;
  }
  TriangleMesh fringe = simplified;
  for (size_t i = 0; i < fringe.positions.size(); ++i)
    if (heights[i].count > 0)
      fringe.positions[i] = assume<Point3<AcquisitionSpace>>(Vec3<double>(
          fringe.positions[i].cast<double>().raw() + heights[i].sum / heights[i].count * directions[i]));
  return fringe;
}

} // namespace surflect::lumigraph
