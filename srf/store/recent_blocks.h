// The blocks that look-ups asked for lately.
#pragma once

#include "srf/store/block_cache.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace surflect {

// Neighbouring look-ups ask for the same few blocks of the same few views: to find one here costs two lines
// of the processor's cache, where view, cache and block cost five. What is found for the first time is asked
// of memory, some lines at a time, so that other work goes on meanwhile.
class RecentBlocks {
public:
  struct Found {
    uint64_t group = 0;    // of what is kept here; 0 for nothing
    uint32_t number = 0;   // in the view's file
    bool isStored = false; // else it is background, and has no number
    bool isNeeded = false; // for the caller: it is not in memory, and was noted
    std::optional<BlockTerms> terms;
  };

  // The cache must outlive this, and keep what it has meanwhile.
  explicit RecentBlocks(const BlockCache& cache) : cache_(&cache) {}

  // Of a position inside the view's image. Valid until another block is looked for that is not one of the
  // four that meet at a corner of this.
  Found& at(uint32_t view, BlockPosition position) {
    const auto x = static_cast<uint32_t>(position.x), y = static_cast<uint32_t>(position.y);
    const uint64_t group = uint64_t{view + 1} << 32 | y / 2 << 16 | x / 2;
    const uint64_t place = group * kGolden >> (64 - kGroupBits);
    Found& found = found_[place << 2 | y % 2 << 1 | x % 2];
    if (found.group != group) {
      found.group = group;
      lookFor(view, position, found);
    }
    return found;
  }

  // Asks for some more of the block that was found last.
  [[gnu::always_inline]] void fetchSome() {
    const size_t end = std::min(values_.size(), asked_ + kLinesAtOnce * kLineBytes);
    for (; asked_ < end; asked_ += kLineBytes) __builtin_prefetch(values_.data() + asked_);
  }
  // For all of it.
  [[gnu::always_inline]] void fetchRest() {
    for (; asked_ < values_.size(); asked_ += kLineBytes) __builtin_prefetch(values_.data() + asked_);
  }

private:
  static constexpr size_t kLineBytes = 64, kLinesAtOnce = 8; // of the processor's cache
  static constexpr int kGroupBits = 6;
  static constexpr uint64_t kGolden = 0x9e3779b97f4a7c15; // 2^64 over the golden ratio
  static_assert(largestViewSide / blockSize / 2 < 1 << 16, "sides of a view in groups of blocks");

  void lookFor(uint32_t view, BlockPosition position, Found& found) {
    fetchRest();
    found.isNeeded = false;
    const auto number = cache_->views()[view].find(position);
    found.isStored = number.has_value();
    if (!number) return;
    found.number = *number;
    found.terms = cache_->resident(view, *number);
    if (!found.terms || found.terms->rank == 0) return;
    const auto lights = static_cast<size_t>(cache_->views()[view].header().lights);
    values_ = {reinterpret_cast<const std::byte*>(found.terms->coefficients),
               valuesBytes(found.terms->stride, lights)};
    asked_ = 0;
  }

  const BlockCache* cache_;
  std::array<Found, size_t{4} << kGroupBits> found_; // of each group four: those that meet never share one
  std::span<const std::byte> values_;                // of the block that was found last
  size_t asked_ = 0;                                 // bytes of these
};

} // namespace surflect
