// Continuity of weights along a path: the largest change between steps is followed into ever smaller steps.
#pragma once

#include "render/lightfield/olf/view_triangulation.h"

#include <cmath>
#include <functional>
#include <map>

namespace surflect::olf {

// Weights above 0 by view.
inline std::map<uint32_t, double> weightsOf(const ClosestViews& closest) {
  std::map<uint32_t, double> weights;
  for (const auto& [view, weight] : closest)
    if (weight > 0) weights[view] += weight;
  return weights;
}

// Sum of the changes of all views' weights.
inline double difference(const ClosestViews& a, const ClosestViews& b) {
  std::map<uint32_t, double> weights = weightsOf(a);
  for (const auto& [view, weight] : b) weights[view] -= weight;
  double sum = 0;
  for (const auto& [view, weight] : weights) sum += std::abs(weight);
  return sum;
}

struct PathChange {
  bool halves = false; // whether halving the steps nearly halves the largest change
  double last =
      0; // after the step with the largest change was halved 30 times, to the half that changes more
};

// Halves the steps up to 8 times, until a halving leaves at most .55 of the largest change between steps.
// Weights that rise within less than a step, as in thin triangles, need several. A jump is never halved.
inline PathChange changeAlong(const std::function<ClosestViews(double)>& viewsAt, int steps) {
  double from = 0, to = 1;
  const auto largest = [&](int count) {
    double most = 0;
    ClosestViews before = viewsAt(0);
    for (int i = 1; i <= count; ++i) {
      const ClosestViews now = viewsAt(static_cast<double>(i) / count);
      if (const double d = difference(before, now); d > most)
        most = d, from = static_cast<double>(i - 1) / count, to = static_cast<double>(i) / count;
      before = now;
    }
    return most;
  };
  PathChange change;
  double before = largest(steps);
  for (int halvings = 0; halvings < 8 && !change.halves; ++halvings) {
    steps *= 2;
    const double now = largest(steps);
    change.halves = now <= 0.55 * before;
    before = now;
  }
  for (int halving = 0; halving < 30; ++halving) {
    const double middle = (from + to) / 2;
    const ClosestViews between = viewsAt(middle);
    if (difference(viewsAt(from), between) > difference(between, viewsAt(to)))
      to = middle;
    else
      from = middle;
  }
  change.last = difference(viewsAt(from), viewsAt(to));
  return change;
}

} // namespace surflect::olf
