// Fur: short tapered tubes on a surface.
#pragma once

#include "render/stage/surface.h"

namespace surflect::stage {

struct FurShape {
  int hairs;
  double length, radius;                    // radius at the root; hairs taper to a point
  Vec3<double> comb = Vec3<double>::Zero(); // displacement of the tips, in lengths
  double disorder = 0;                      // randomness of directions and lengths: 0 none, 1 wild
  uint64_t seed = 1;
};

// Hairs rooted evenly over the skin's area; the skin itself is not included. They start along its normals and
// bend towards `comb`. Each hair has the texture coordinates of its root, (0, 0) if the skin has none. Throws
// Error as addTube does.
Surface fur(const Surface& skin, const FurShape& shape);

} // namespace surflect::stage
