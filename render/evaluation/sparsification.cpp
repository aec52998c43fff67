#include "render/evaluation/sparsification.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>

namespace surflect::evaluation {

namespace {

// RMS of the parts that are left when those of the largest keys are taken away.
std::vector<double> curveBy(std::span<const double> keys, std::span<const double> error, size_t steps) {
  const size_t count = error.size();
  std::vector<size_t> order(count);
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::sort(order, {}, [&](size_t i) { return keys[i]; });
  std::vector<double> sums{0}; // of the squared errors of the first parts; equal keys have their mean
  for (size_t first = 0, last = 0; first < count; first = last) {
    double sum = 0;
    for (; last < count && keys[order[last]] == keys[order[first]]; ++last)
      sum += error[order[last]] * error[order[last]];
    const double mean = sum / static_cast<double>(last - first);
    for (size_t i = first; i < last; ++i) sums.push_back(sums.back() + mean);
  }
  std::vector<double> curve;
  for (size_t step = 0; step < steps && count > 0; ++step) {
    const size_t kept = std::max(size_t{1}, count - count * step / steps);
    curve.push_back(std::sqrt(sums[kept] / static_cast<double>(kept)));
  }
  return curve;
}

} // namespace

Sparsification sparsify(std::span<const double> error, std::span<const double> predicted, size_t steps) {
  assert(error.size() == predicted.size() && steps >= 1);
  return {curveBy(predicted, error, steps), curveBy(error, error, steps)};
}

double sparsificationError(const Sparsification& curves) {
  if (curves.best.empty() || !(curves.best[0] > 0)) return 0;
  double sum = 0;
  for (size_t step = 0; step < curves.best.size(); ++step)
    sum += curves.byPrediction[step] - curves.best[step];
  return sum / static_cast<double>(curves.best.size()) / curves.best[0];
}

} // namespace surflect::evaluation
