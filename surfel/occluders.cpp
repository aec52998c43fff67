#include "surfel/occluders.h"

#include "surfel/cloud.h"
#include "surfel/math/median.h"

#include <algorithm>

namespace surflect {

Occluders occludersOf(const SurfelCloud& cloud, const LevelsOfDetail& levels, size_t most) {
  const size_t level = finestLevel(levels, most);
  Occluders occluders;
  for (uint32_t i = 0; i < cloud.size(); ++i) {
    if (levels.of(i).size() <= level || !(cloud.coverage[i] > 0)) continue;
    occluders.surfels.push_back(i);
    occluders.splats.push_back(levels.of(i)[level]);
  }
  std::vector<float> radii;
  for (const DetailSplat& splat : occluders.splats) radii.push_back(splat.radius);
  if (!radii.empty()) occluders.clearance = static_cast<float>(median({radii.begin(), radii.end()}));
  return occluders;
}

namespace {

template <class Space>
OpaqueSplat<Space> opaque(const Point3<Space>& center, const Vec3<float>& u, const Vec3<float>& v,
                          const DetailSplat& splat) {
  const float reach = kReachPerRadius * splat.radius;
  return {center, assume<Direction3<Space>>(Vec3<float>(reach * u)),
          assume<Direction3<Space>>(Vec3<float>(reach * v)), splat.coverage};
}

} // namespace

SplatCaster<AcquisitionSpace> casterOf(const Occluders& occluders, const SurfelCloud& cloud,
                                       const Progress& progress) {
  std::vector<OpaqueSplat<AcquisitionSpace>> splats;
  for (size_t i = 0; i < occluders.surfels.size(); ++i) {
    const uint32_t surfel = occluders.surfels[i];
    const Mat3<float> frame = rotationOf<float>(cloud.r0[surfel]);
    splats.push_back(opaque(cloud.p0[surfel], frame.col(0), frame.col(1), occluders.splats[i]));
  }
  return SplatCaster(splats, progress);
}

SplatCaster<ObjectSpace> casterOf(const Occluders& occluders, const DeformedCloud& deformed,
                                  const Progress& progress) {
  std::vector<OpaqueSplat<ObjectSpace>> splats;
  for (size_t i = 0; i < deformed.size(); ++i)
    if (deformed.handedness[i] != Handedness::dead)
      splats.push_back(opaque(deformed.p[i], deformed.u[i].raw(), deformed.v[i].raw(), occluders.splats[i]));
  return SplatCaster(splats, progress);
}

} // namespace surflect
