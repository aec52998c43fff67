#include "srf/ulr/weight_truncation.h"

#include <array>
#include <cassert>

namespace surflect::ulr {

void truncate(BlendSet& blend, float error) {
  assert(error >= 0 && error <= kMostTruncated);
  if (error == 0 || blend.size() < 2) return;
  std::array<float, kMaxBlended> weights;
  float sum = 0, kept = 0;
  for (size_t i = 0; i < blend.size(); ++i) sum += weights[i] = blend[i].weight;
  for (size_t i = 0; i < blend.size(); ++i)
    kept += blend[i].weight *= keptShare({weights.data(), blend.size()}, sum, i, error);
  BlendSet truncated;
  for (const auto& [index, weight] : blend)
    if (weight > 0) truncated.push({index, weight * (sum / kept)});
  blend = truncated;
}

} // namespace surflect::ulr
