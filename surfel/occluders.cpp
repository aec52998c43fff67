#include "surfel/occluders.h"

#include "surfel/cloud.h"
#include "surfel/math/median.h"

#include <algorithm>

namespace surflect {

Occluders occludersOf(const SurfelCloud& cloud, const LevelsOfDetail& levels, size_t most) {
  const size_t level = finestLevel(levels, most);
  Occluders occluders;
  for (uint32_t i = 0; i < cloud.size(); ++i) {
    if (levels.of(i).size() <= level) continue;
    occluders.surfels.push_back(i);
    occluders.radius.push_back(levels.of(i)[level].radius);
  }
  if (!occluders.radius.empty())
    occluders.clearance = static_cast<float>(median({occluders.radius.begin(), occluders.radius.end()}));
  return occluders;
}

DiscCaster<AcquisitionSpace> casterOf(const Occluders& occluders, const SurfelCloud& cloud,
                                      const Progress& progress) {
  std::vector<Point3<AcquisitionSpace>> centers;
  std::vector<Normal3<AcquisitionSpace>> normals;
  for (const uint32_t i : occluders.surfels) {
    centers.push_back(cloud.p0[i]);
    normals.push_back(assume<Normal3<AcquisitionSpace>>(rotationOf<float>(cloud.r0[i]).col(2)));
  }
  return {centers, normals, occluders.radius, progress};
}

DiscCaster<ObjectSpace> casterOf(const Occluders& occluders, const DeformedCloud& deformed,
                                 const Progress& progress) {
  std::vector<Point3<ObjectSpace>> centers;
  std::vector<Normal3<ObjectSpace>> normals;
  std::vector<float> radii;
  for (size_t i = 0; i < deformed.size(); ++i) {
    if (deformed.handedness[i] == Handedness::dead) continue;
    const Vec3<float> u = deformed.u[i].raw(), v = deformed.v[i].raw();
    centers.push_back(deformed.p[i]);
    normals.push_back(assume<Normal3<ObjectSpace>>(u.cross(v).normalized()));
    radii.push_back(longerAxis(u, v) * occluders.radius[i]);
  }
  return {centers, normals, radii, progress};
}

} // namespace surflect
