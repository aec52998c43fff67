// Occluders: splats that cast the shadows of a cloud, from a level of detail coarse enough for fast rays.
#pragma once

#include "surfel/cloud.h"
#include "surfel/geometry/splat_caster.h"
#include "surfel/level_of_detail.h"
#include "surfel/sampling.h"

#include <cmath>
#include <cstdint>
#include <vector>

namespace surflect {

// Where the kernel of a splat ends, in radii: that of SplatCaster with the peak and the integral of a
// Gaussian ends at sqrt(6) sigma.
inline const float kReachPerRadius = std::sqrt(6.f) * kSigmaPerRadius;

struct Occluders {
  std::vector<uint32_t> surfels;   // ascending
  std::vector<DetailSplat> splats; // one for each of them
  // Offset of shadow rays along the normal, and least distance of a hit: keeps a surface from shadowing
  // itself. At rest; scene units.
  float clearance = 0;
};

// The finest level of at most `most` surfels, or else the coarsest level.
inline constexpr size_t kMostOccluders = 1 << 15;
Occluders occludersOf(const SurfelCloud& cloud, const LevelsOfDetail& levels, size_t most = kMostOccluders);

// Caster of the occluders at rest.
SplatCaster<AcquisitionSpace> casterOf(const Occluders& occluders, const SurfelCloud& cloud,
                                       const Progress& progress = {});
// Caster of the occluders after a warp; `deformed` has one entry for each occluder. Dead surfels cast no
// shadow.
SplatCaster<ObjectSpace> casterOf(const Occluders& occluders, const DeformedCloud& deformed,
                                  const Progress& progress = {});

// Part of a light that reaches a surface with this unit normal, 0..1: 0 if it faces away, else what no
// occluder blocks. `distance` to the light may be infinite; clearance as above, times the stretch of the
// surface.
template <class Space>
float reaching(const SplatCaster<Space>& caster, const Point3<Space, double>& p,
               const Normal3<Space, double>& normal, const Direction3<Space, double>& towards,
               double distance, double clearance) {
  if (!(dot(normal, towards) > 0)) return 0;
  const auto lifted = p + assume<Direction3<Space, double>>(clearance * normal.raw());
  return 1 - caster.blocked(lifted, towards, clearance, distance);
}

} // namespace surflect
