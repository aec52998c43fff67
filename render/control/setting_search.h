// Search for the best combination of knob steps under a model.
#pragma once

#include "render/control/knob_effects.h"

#include <functional>
#include <optional>
#include <span>

namespace surflect::control {

struct SearchLimits {
  double squaredError = 0; // at most this in every frame
  double cost = 0;         // at most this in every frame
};

enum class Objective { cost, error };

// The steps that minimise the largest objective over the frames, within the limits; empty if no steps keep
// them. Exact: branch and bound over all combinations that `isExcluded` does not reject. Of equally good
// steps, the first in lexicographic order. Errors must not be negative.
std::optional<Steps> bestSteps(std::span<const KnobEffects> knobs, std::span<const FrameModel> frames,
                               const SearchLimits& limits, Objective objective,
                               const std::function<bool(const Steps&)>& isExcluded = {});

} // namespace surflect::control
