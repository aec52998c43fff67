// Occluders: opaque discs that cast the shadows of a cloud, from a level of detail coarse enough for fast
// rays.
#pragma once

#include "surfel/cloud.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/level_of_detail.h"

#include <cmath>
#include <cstdint>
#include <vector>

namespace surflect {

struct Occluders {
  std::vector<uint32_t> surfels; // ascending
  std::vector<float> radius;     // one per disc; wide enough to leave no holes
  // Offset of shadow rays along the normal, and least distance of a hit: keeps a surface from shadowing
  // itself. At rest; scene units.
  float clearance = 0;
};

// The finest level of at most `most` surfels, or else the coarsest level.
inline constexpr size_t kMostOccluders = 1 << 15;
Occluders occludersOf(const SurfelCloud& cloud, const LevelsOfDetail& levels, size_t most = kMostOccluders);

// Longer half-axis of the ellipse that a unit circle becomes under tangents u and v: the largest singular
// value of the matrix (u, v).
template <class T> T longerAxis(const Vec3<T>& u, const Vec3<T>& v) {
  const T uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
  return std::sqrt((uu + vv) / 2 + std::hypot((uu - vv) / 2, uv));
}

// Caster of the occluders at rest.
DiscCaster<AcquisitionSpace> casterOf(const Occluders& occluders, const SurfelCloud& cloud,
                                      const Progress& progress = {});
// Caster of the occluders after a warp; `deformed` has one entry for each occluder. Discs are as wide as
// their splats' longer axis; dead surfels cast no shadow.
DiscCaster<ObjectSpace> casterOf(const Occluders& occluders, const DeformedCloud& deformed,
                                 const Progress& progress = {});

// True if a surface with this unit normal faces away from the light, or if a disc lies between. `distance` to
// the light may be infinite; clearance as above, times the stretch of the surface.
template <class Space>
bool isHidden(const DiscCaster<Space>& caster, const Point3<Space, double>& p,
              const Normal3<Space, double>& normal, const Direction3<Space, double>& towards, double distance,
              double clearance) {
  if (!(dot(normal, towards) > 0)) return true;
  const auto lifted = p + assume<Direction3<Space, double>>(clearance * normal.raw());
  return caster.occluded(lifted, towards, clearance, distance);
}

} // namespace surflect
