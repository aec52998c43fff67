// "In the limit, the BRDF preservation is exact as the SRF geometry converges to the real object geometry."
// [Weyrich 2005, §4.4]
//
// The field is asked where it is known without interpolation: a glossy, textured unit sphere, for which
// SRF(p, l, v) is what the ray p + t v sees of it under l. The impostor is the same sphere blown up by d.
// Two of the errors of §4.4 remain. The warp turns the impostor point by another rotation than the surface
// point behind it, and the ray that is brought back meets the surface elsewhere than the warped ray did. To
// first order both are d times a derivative of the warp, so that the error falls linearly.
#pragma once

#include "warp/warp.h"

#include <cstddef>
#include <cstdint>

namespace surflect::bench {

struct LimitError {
  double radiance = 0; // RMS error over the RMS of the truth
  double shift = 0;    // RMS distance, at rest, between the points that the two rays meet; radii
  double turn = 0;     // RMS angle between the normal brought back by L and that of the point met; radians
  size_t queries = 0;  // whose ray meets the bent sphere
};

// Random surfels seen and lit from random directions; the warp has an exact Jacobian and keeps the sphere in
// front of the viewer near enough to where it was for Newton's method to follow. d is 0..0.3 radii.
LimitError limitError(const warp::Warp& warp, double d, size_t queries, uint64_t seed);

} // namespace surflect::bench
