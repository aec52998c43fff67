// Ghosting by wrong depth.
//
// [Azuma 1999, §4.3.2, Fig. 4.5]
// Symbols: d depth of the object below the st plane, e error of the depth that is used to correct rays, p
// distance of the planes, s spacing of st nodes, u spacing of uv texels.
#pragma once

#include <cassert>

namespace surflect::lumigraph {

// Distance, in texels, between what two neighbouring nodes show at one pixel: p e s / (d (d + e) u).
// Two rays from nodes s apart that meet at depth d + e are s e / (d + e) apart at depth d, which the planes'
// scale p / d takes to the uv plane.
inline double ghostOffset(double p, double e, double s, double d, double u) {
  assert(d > 0 && d + e > 0 && u > 0);
  return p * e * s / (d * (d + e) * u);
}

} // namespace surflect::lumigraph
