// Truncation of a blend: sources of small weight are left out, so that fewer photographs are looked up. Not
// in the papers.
//
//   c_i = sum over j  w_j clamp(2 - w_j / w_i, 0, 1)
//   f_i = clamp(c_i / a - 1, 0, 1),  a = 2 e / 3
//   w'_i = f_i w_i / sum f w
//
// Symbols: w_i weight of source i, not negative; weights sum to 1. e, 0..kMostTruncated, bounds the weight
// that is removed. c_i is the sum of all weights up to w_i; weights up to 2 w_i count in part, so that c_i
// stays continuous where two sources change places. f_i fades: a source has weight 0 when it leaves the
// blend.
//
// The removed weight d = sum (1 - f) w is at most e. Let weights ascend, and S_i = w_1 + .. + w_i <= c_i.
// Then 1 - f_i <= g(S_i) for the falling function g(s) = clamp(2 - s / a, 0, 1), and sum w_i g(S_i) is at
// most the integral of g, 3 a / 2 = e.
//
// The mean of any values of the sources changes by d times the difference between the means of what is
// removed and what is kept, and thus by at most e times the spread of the values.
#pragma once

#include "srf/ulr/ulr.h"

#include <algorithm>
#include <cstddef>
#include <span>

namespace surflect::ulr {

inline constexpr float kMostTruncated = 0.5f; // leaves the source of largest weight

// f_i of weights that sum to `sum`.
inline float keptShare(std::span<const float> weights, float sum, size_t i, float error) {
  float c = 0;
  for (const float w : weights)
    if (w < 2 * weights[i]) c += w * std::min(2 - w / weights[i], 1.f);
  return std::clamp(1.5f * c / (error * sum) - 1, 0.f, 1.f);
}

// Truncates a blend, keeping the sum of its weights. An error of 0 changes nothing.
void truncate(BlendSet& blend, float error);

} // namespace surflect::ulr
