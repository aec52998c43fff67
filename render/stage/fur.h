// Fur: short tapered tubes that stand on a surface.
#pragma once

#include "render/stage/surface.h"

namespace surflect::stage {

struct FurShape {
  int hairs;
  double length, radius;                    // at the root; it tapers to a point
  Vec3<double> comb = Vec3<double>::Zero(); // where the tips go to, in lengths
  double disorder = 0;                      // of directions and lengths: 0 none, 1 wild
  uint64_t seed = 1;
};

// Hairs rooted evenly over the surface's area, which itself is left out. They leave it along its normals and
// bend towards `comb`. Each has everywhere the texture coordinates of its root, (0, 0) where the skin has
// none. Throws Error as addTube does.
Surface fur(const Surface& skin, const FurShape& shape);

} // namespace surflect::stage
