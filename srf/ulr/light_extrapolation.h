// Light from directions without captured lights. ULR extrapolates [Weyrich 2005, §5.2]: the nearest captured
// lights are used at any distance. On a rig that covers only a cone or a dome, all other light of an
// environment would pile up on the rim; there it can be faded out instead.
#pragma once

#include "surfel/math/space.h"

#include <span>

namespace surflect::ulr {

enum class LightExtrapolation { clamp, fade };

// Spacing of a rig's lights, and the fade of light beyond them.
class LightExtrapolationFade {
public:
  // `lights` are unit directions from the middle of the object to the captured lights. The spacing is the
  // largest distance from a light to its nearest neighbour, so that nothing fades between the rig's lights.
  explicit LightExtrapolationFade(std::span<const Direction3<AcquisitionSpace, double>> lights);

  // Radians; pi if there are fewer than two distinct directions, in which case nothing fades.
  double spacing() const { return spacing_; }

  // Fade factor: 1 up to one spacing from the nearest captured light, 0 beyond two, continuously
  // differentiable. `penalty` is 1 - cos of the angle to that light.
  float at(float penalty) const;

private:
  double spacing_, from_, to_; // from_, to_: penalties
};

} // namespace surflect::ulr
