#include "render/lightfield/common/front_hit.h"

namespace surflect::lightfield {

std::optional<RayCaster<AcquisitionSpace>::Hit>
firstFrontHit(const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& rays,
              const Point3<AcquisitionSpace, double>& origin,
              const Direction3<AcquisitionSpace, double>& direction) {
  constexpr int kBacks = 1000; // crossed at most
  double start = 0;
  for (int crossed = 0; crossed < kBacks; ++crossed) {
    auto hit = rays.firstHit(origin + start * direction, direction);
    if (!hit) return std::nullopt;
    hit->distance += start;
    if (areaVector(mesh, hit->triangle).dot(direction.raw()) < 0) return hit;
    start = hit->distance + rays.selfHitOffset();
  }
  return std::nullopt;
}

} // namespace surflect::lightfield
