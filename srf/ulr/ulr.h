// Unstructured lumigraph weights: one blending function for cameras, for lights and for pairs of both.
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

namespace surflect::ulr {

// Angular penalty 1 - cos(angle) of two unit directions, as |a - b|^2 / 2, which is precise for small angles.
template <class Space, class T> T anglePenalty(const Direction3<Space, T>& a, const Direction3<Space, T>& b) {
  return (a.raw() - b.raw()).squaredNorm() / 2;
}

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
  float worst() const {
    return count_ < capacity_ ? std::numeric_limits<float>::infinity() : nearest_[count_ - 1].penalty;
  }

private:
  std::array<Candidate, kMaxBlended + 1> nearest_;
  size_t capacity_, count_ = 0;
};

// p_t: the penalty of the (k+1)-th candidate, but at most max(1, 2 p_1), so that a candidate beyond 90
// degrees counts only if none is within 60. Beyond, 2 p_1 replaces 1, so that one candidate can still fade
// over to another as both pass 90 degrees.
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
// sources see a surfel; of two surfels in a pixel, the one seen better should determine the colour. Ours.
inline float confidenceOf(float penalty) {
  const float share = 1 / (1 + std::min(penalty, 30.f));
  return share * share * share * share;
}

} // namespace surflect::ulr
