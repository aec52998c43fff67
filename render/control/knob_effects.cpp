#include "render/control/knob_effects.h"

#include <algorithm>
#include <cassert>

namespace surflect::control {

double squaredError(std::span<const KnobEffects> knobs, const FrameModel& frame, const Steps& steps) {
  double sum = 0;
  for (size_t k = 0; k < knobs.size(); ++k) sum += frame.weights[k] * knobs[k][steps[k]].squaredError;
  return sum;
}

double cost(std::span<const KnobEffects> knobs, const FrameModel& frame, const Steps& steps) {
  double sum = 0;
  for (size_t j = 0; j < frame.stageCosts.size(); ++j) {
    double stage = frame.stageCosts[j];
    for (size_t k = 0; k < knobs.size(); ++k) stage *= knobs[k][steps[k]].ratios[j];
    sum += stage;
  }
  return sum;
}

void correct(std::span<const KnobEffects> knobs, const Steps& steps, double measuredSquaredError,
             FrameModel& frame) {
  constexpr double kLeastWeight = 0.01;
  double norm = 0;
  for (size_t k = 0; k < knobs.size(); ++k) {
    const double x = knobs[k][steps[k]].squaredError;
    norm += x * x;
  }
  if (norm == 0) return;
  const double missing = measuredSquaredError - squaredError(knobs, frame, steps);
  for (size_t k = 0; k < knobs.size(); ++k)
    frame.weights[k] =
        std::max(kLeastWeight, frame.weights[k] + missing * knobs[k][steps[k]].squaredError / norm);
}

bool isAtLeastAsFast(const Steps& a, const Steps& b) {
  assert(a.size() == b.size());
  return std::ranges::equal(a, b, std::ranges::greater_equal{});
}

} // namespace surflect::control
