#include "render/lightfield/olf/closest_views.h"

#include <algorithm>

namespace surflect::olf {

ClosestViews ulrViews(std::span<const double> penalties) {
  // Makes the weight of an exactly met view 1.
  constexpr double kFloor = 1e-14;
  constexpr size_t kNearest = ClosestViews::kMost + 1;
  std::array<uint32_t, kNearest> nearest{};
  size_t count = 0;
  for (uint32_t i = 0; i < penalties.size(); ++i) {
    if (count == kNearest && !(penalties[i] < penalties[nearest[count - 1]])) continue;
    size_t at = count < kNearest ? count++ : count - 1;
    for (; at > 0 && penalties[nearest[at - 1]] > penalties[i]; --at) nearest[at] = nearest[at - 1];
    nearest[at] = i;
  }
  ClosestViews closest;
  if (count == 0) return closest;
  const size_t blended = count < 3 ? count : count - 1;
  const double threshold = count < 3 ? 1 : penalties[nearest[count - 1]]; // p_k
  double sum = 0;
  for (size_t i = 0; i < blended; ++i) {
    const double p = std::max(penalties[nearest[i]], kFloor);
    const double r = std::max(0.0, threshold - p) / p; // Eq. 4
    closest.push({nearest[i], r});
    sum += r;
  }
  if (sum > 0)
    for (WeightedView& view : closest) view.weight /= sum;
  else
    closest.begin()->weight = 1;
  return closest;
}

} // namespace surflect::olf
