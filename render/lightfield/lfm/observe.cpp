#include "render/lightfield/lfm/observe.h"

namespace surflect::lfm {

Observe observeIn(const lightfield::Sight& sight, const TriangleMesh& mesh, const SmoothNormals& normals) {
  return [&](uint32_t triangle, const Point3<AcquisitionSpace, double>& point) {
    if (!(areaVector(mesh, triangle).squaredNorm() > 0)) return std::vector<Observation>();
    return sight.observations(lightfield::surfacePoint(mesh, normals, triangle, point));
  };
}

} // namespace surflect::lfm
