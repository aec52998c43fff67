#include "srf/capture/matte_vote.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace surflect::capture {

namespace {

constexpr size_t kMattesPerVote = 8;

size_t neededVotes(size_t mattes) { return std::max<size_t>(1, mattes / kMattesPerVote); }

void takeLarger(image::Image& largest, const image::Image& alpha) {
  if (largest.values.empty()) {
    largest = alpha;
    return;
  }
  for (size_t i = 0; i < alpha.values.size(); ++i)
    largest.values[i] = std::max(largest.values[i], alpha.values[i]);
}

} // namespace

MatteVote::MatteVote(size_t mattes) : kept_(neededVotes(mattes)) {}

void MatteVote::add(const image::Image& alpha) {
  assert(alpha.channels == 1);
  const auto isObject = [](float value) { return value > 0.5f; };
  if (std::ranges::none_of(alpha.values, isObject)) return takeLarger(empty_, alpha);
  if (std::ranges::all_of(alpha.values, isObject)) return takeLarger(full_, alpha);
  ++voting_;
  if (ranks_.size() < kept_) ranks_.emplace_back(alpha.width, alpha.height, 1);
  for (size_t i = 0; i < alpha.values.size(); ++i) {
    float value = alpha.values[i];
    for (image::Image& rank : ranks_) {
      if (!(value > rank.values[i])) continue;
      std::swap(value, rank.values[i]);
    }
  }
}

image::Image MatteVote::outcome() const {
  if (voting_ > 0) return ranks_[neededVotes(voting_) - 1];
  return full_.values.empty() ? empty_ : full_;
}

} // namespace surflect::capture
