// Light from directions where no light was captured. ULR extrapolates [Weyrich 2005, §5.2]: the nearest
// captured lights answer, however far they are. A rig that covers a cone or a dome would pile onto its rim
// all the light of an environment that comes from elsewhere; there such light can be faded out instead.
#pragma once

#include "surfel/math/space.h"

#include <span>

namespace surflect::ulr {

enum class LightExtrapolation { clamp, fade };

// The spacing of a rig's lights, and the fade of light beyond them.
class LightCoverage {
public:
  // Unit directions to the captured lights, from the middle of the object. The spacing of a rig is the
  // largest distance between a light and its nearest neighbour, so that there is no change between its
  // lights.
  explicit LightCoverage(std::span<const Direction3<AcquisitionSpace, double>> lights);

  // Radians; pi where fewer than two directions differ: then nothing fades.
  double spacing() const { return spacing_; }

  // 1 up to one spacing from the nearest captured light, 0 from two on, continuously differentiable between.
  // `penalty`: 1 - cos of the angle to it.
  float at(float penalty) const;

private:
  double spacing_, from_, to_; // the last two as penalties
};

} // namespace surflect::ulr
