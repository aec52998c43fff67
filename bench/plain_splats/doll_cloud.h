// A doll of overlapping balls: a closed solid whose limbs hide parts of each other, as many surfels as the
// doll of [Weyrich 2005] had and as large on a picture of 1024 x 768.
#pragma once

#include "srf/capture/camera.h"
#include "surfel/cloud.h"

namespace surflect::bench {

constexpr size_t kDollSurfels = 532'935;

enum class SurfelOrder { coherent, shuffled }; // along a space-filling curve; at random

struct DollCloud {
  SurfelCloud rest;
  DeformedCloud deformed;    // by the identity
  std::vector<float> colors; // RGB of each surfel
};

// About `surfels` of them, all of one size, within 1 % if there are more than 10,000.
DollCloud dollCloud(size_t surfels, SurfelOrder order);

// Sees the doll from the front; it fills most of the picture.
capture::Camera<ObjectSpace> dollCamera(int width, int height);

} // namespace surflect::bench
