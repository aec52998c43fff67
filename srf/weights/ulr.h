// Unstructured lumigraph weights: one blending function for cameras, for lights and for pairs of both.
// Weights can be truncated: sources of small weight are left out, so that fewer photographs are looked up.
//
// [Buehler 2001] Buehler et al.: Unstructured Lumigraph Rendering, SIGGRAPH.   [Weyrich 2005, §5.2]
// Symbols: p_i penalty of candidate i, p_t threshold penalty, r_i relevance, w_i weight.
#pragma once

#include "surfel/math/space.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

namespace surflect::weights {

// Angular penalty 1 - cos(angle) of two unit directions, as |a - b|^2 / 2, which is precise for small angles.
template <class Space, class T> T anglePenalty(const Direction3<Space, T>& a, const Direction3<Space, T>& b) {
  return (a.raw() - b.raw()).squaredNorm() / 2;
}

inline constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct Candidate {
  uint32_t index = 0;
  float penalty = 0; // >= 0; candidates with infinite or NaN penalties are never chosen
};

struct Blended {
  uint32_t index = 0;
  float weight = 0;
};

inline constexpr size_t kMaxBlended = 16;

// The blended candidates and their weights.
class BlendSet {
public:
  void push(Blended blended) {
    assert(count_ < kMaxBlended);
    items_[count_++] = blended;
  }
  size_t size() const { return count_; }
  bool empty() const { return count_ == 0; }
  Blended* begin() { return items_.data(); }
  Blended* end() { return items_.data() + count_; }
  const Blended* begin() const { return items_.data(); }
  const Blended* end() const { return items_.data() + count_; }
  Blended& operator[](size_t i) { return items_[i]; }
  const Blended& operator[](size_t i) const { return items_[i]; }

private:
  std::array<Blended, kMaxBlended> items_;
  size_t count_ = 0;
};

// The k + 1 candidates of smallest penalty seen so far, in order; ties keep the order of arrival.
class NearestCandidates {
public:
  explicit NearestCandidates(size_t k) : capacity_(k + 1) { assert(k >= 1 && k <= kMaxBlended); }

  void offer(Candidate candidate) {
    if (!(candidate.penalty < worst())) return;
    size_t i = count_ < capacity_ ? count_++ : count_ - 1;
    for (; i > 0 && nearest_[i - 1].penalty > candidate.penalty; --i) nearest_[i] = nearest_[i - 1];
    nearest_[i] = candidate;
  }
  std::span<const Candidate> sorted() const { return {nearest_.data(), count_}; }
  size_t capacity() const { return capacity_; }
  // Penalties that are not below worst() are not kept.
  float worst() const { return count_ < capacity_ ? kInfinity : nearest_[count_ - 1].penalty; }

private:
  std::array<Candidate, kMaxBlended + 1> nearest_;
  size_t capacity_, count_ = 0;
};

// p_t: the penalty of the (k+1)-th candidate, but at most max(1, 2 p_1), so that a candidate beyond 90
// degrees counts only if none is within 60 degrees. If none is, 2 p_1 exceeds 1, so that one candidate can
// still fade over to another as both pass 90 degrees.
inline float thresholdPenalty(std::span<const Candidate> nearest, size_t k) {
  const float limit = std::max(1.f, 2 * nearest[0].penalty);
  return nearest.size() > k ? std::min(nearest[k].penalty, limit) : limit;
}

// r_i = (1 - p_i / p_t) / p_i, w_i = r_i / sum r  [Buehler 2001, §4; Weyrich 2005, §5.2]. The floor of p
// makes the weight of an exactly met candidate 1 (epipole consistency). Equal penalties get equal shares.
// Weights are positive and sum to one.
inline BlendSet ulrWeights(const NearestCandidates& candidates) {
  constexpr float kFloor = 1e-12f;
  BlendSet blend;
  const auto nearest = candidates.sorted();
  if (nearest.empty()) return blend;
  const size_t k = candidates.capacity() - 1;
  const size_t count = std::min(k, nearest.size());
  const float threshold = thresholdPenalty(nearest, k);
  float sum = 0;
  for (const auto& [index, penalty] : nearest.first(count)) {
    const float p = std::max(penalty, kFloor);
    const float relevance = std::max(0.f, 1 - p / threshold) / p;
    if (relevance > 0) blend.push({index, relevance});
    sum += relevance;
  }
  if (blend.empty()) // if all penalties equal the threshold
    for (const auto& candidate : nearest.first(count))
      if (candidate.penalty <= nearest[0].penalty) {
        blend.push({candidate.index, 1});
        sum += 1;
      }
  for (auto& blended : blend) blended.weight /= sum;
  return blend;
}

// Confidence of a blend whose best source has this penalty, relative to other surfels at the same pixel: 1
// for a penalty of 0, 1/16 for a penalty of 1, at least 1e-6. ULR weights sum to one however badly the
// sources see a surfel; of two surfels in a pixel, the one seen better should determine the colour. Not in
// the papers.
inline float confidenceOf(float penalty) {
  const float share = 1 / (1 + std::min(penalty, 30.f));
  return share * share * share * share;
}

// Truncation of a blend. Not in the papers.
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
inline constexpr float kMostTruncated = 0.5f; // leaves the source of largest weight

// f_i of weights that sum to `sum`.
inline float keptShare(std::span<const float> weights, float sum, size_t i, float error) {
  float c = 0;
  for (const float w : weights)
    if (w < 2 * weights[i]) c += w * std::min(2 - w / weights[i], 1.f);
  return std::clamp(1.5f * c / (error * sum) - 1, 0.f, 1.f);
}

// Returns the truncated blend, whose weights have the same sum. An error of 0 changes nothing.
inline BlendSet truncated(const BlendSet& blend, float error) {
  assert(error >= 0 && error <= kMostTruncated);
  if (error == 0 || blend.size() < 2) return blend;
  std::array<float, kMaxBlended> weights;
  float sum = 0, kept = 0;
  for (size_t i = 0; i < blend.size(); ++i) sum += weights[i] = blend[i].weight;
  BlendSet rest;
  for (size_t i = 0; i < blend.size(); ++i) {
    const float weight = blend[i].weight * keptShare({weights.data(), blend.size()}, sum, i, error);
    kept += weight;
    if (weight > 0) rest.push({blend[i].index, weight});
  }
  for (auto& blended : rest) blended.weight *= sum / kept;
  return rest;
}

} // namespace surflect::weights
