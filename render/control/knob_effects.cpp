#include "render/control/knob_effects.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace surflect::control {

double relativeRms(const image::Image& a, const image::Image& b) {
  assert(a.width == b.width && a.height == b.height && a.channels == b.channels && a.channels >= 3);
  const auto channels = static_cast<size_t>(a.channels);
  double difference = 0, energy = 0; // summed in one order, so that the bits do not depend on threads
  for (size_t i = 0; i < a.values.size(); i += channels)
    for (size_t c = i; c < i + 3; ++c) {
      const double d = double{a.values[c]} - double{b.values[c]};
      difference += d * d;
      energy += double{b.values[c]} * double{b.values[c]};
    }
  if (difference == 0) return 0;
  return energy > 0 ? std::sqrt(difference / energy) : std::numeric_limits<double>::infinity();
}

namespace {

ErrorSums sumsOf(std::span<const KnobEffects> knobs, const FrameModel& frame, const Steps& steps) {
  ErrorSums sums;
  for (size_t k = 0; k < knobs.size(); ++k) sums.add(frame.weights[k], knobs[k][steps[k]]);
  return sums;
}

} // namespace

double squaredError(std::span<const KnobEffects> knobs, const FrameModel& frame, const Steps& steps) {
  return sumsOf(knobs, frame, steps).squaredError(frame.correlation);
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
  constexpr int kProjections = 8;
  std::vector<double> slopes(knobs.size()); // of the squared error, by each weight
  for (int projection = 0; projection < kProjections; ++projection) {
    const ErrorSums sums = sumsOf(knobs, frame, steps);
    const double c = frame.correlation, slope = sums.ofErrors * sums.ofErrors - sums.ofSquares; // by c
    double norm = slope * slope;
    for (size_t k = 0; k < knobs.size(); ++k) {
      const double square = knobs[k][steps[k]].squaredError;
      slopes[k] = (1 - c) * square + c * sums.ofErrors * std::sqrt(square / frame.weights[k]);
      norm += slopes[k] * slopes[k];
    }
    if (norm == 0) return;
    const double share = (measuredSquaredError - sums.squaredError(c)) / norm;
    for (size_t k = 0; k < knobs.size(); ++k)
      frame.weights[k] = std::max(kLeastWeight, frame.weights[k] + share * slopes[k]);
    frame.correlation = std::clamp(c + share * slope, 0.0, 1.0);
  }
}

bool isAtLeastAsFast(const Steps& a, const Steps& b) {
  assert(a.size() == b.size());
  return std::ranges::equal(a, b, std::ranges::greater_equal{});
}

} // namespace surflect::control
