// The blocks that look-ups ask for, by names of their own.
#pragma once

#include "srf/store/block_cache.h"
#include "srf/store/light_weight.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace surflect {

// Neighbouring look-ups ask for the same few blocks of the same few views. Many are named first. Then those
// that are new are found, one right after the other, so that the processor waits for several at a time: each
// lies behind its view, the view's index, and two places of the cache. Then their coefficients are asked of
// memory, in the order in which they were named, some at a time, so that other work goes on meanwhile.
class AskedBlocks {
public:
  enum class State : uint8_t { background, onDisk, inMemory };
  struct Block {
    BlockKey key; // background has none
    State state = State::background;
    bool isNeeded = false; // for the caller: it was noted
    BlockTerms terms;      // of what is in memory
  };

  // The cache must outlive this, and keep what it has meanwhile.
  explicit AskedBlocks(const BlockCache& cache) : cache_(&cache), slots_(size_t{1} << kFirstBits, kFree) {}

  // The number here of the block at a position inside the view's image; it is known after findAll. `row` are
  // the lights of who asks; those of a block that is new must last until fetchRest.
  uint32_t nameOf(uint32_t view, BlockPosition position, std::span<const LightWeight> row) {
    const uint64_t key =
        uint64_t{view} << 32 | static_cast<uint32_t>(position.y) << 16 | static_cast<uint32_t>(position.x);
    uint32_t& slot = slotOf(key);
    if (slot != kFree) return slot;
    const auto name = slot = static_cast<uint32_t>(named_.size());
    named_.push_back({key, row});
    if (2 * named_.size() > slots_.size()) grow();
    return name;
  }
  size_t named() const { return named_.size(); }

  // Finds all that have been named.
  void findAll() {
    for (size_t name = blocks_.size(); name < named_.size(); ++name) {
      const uint64_t key = named_[name].key;
      const auto view = static_cast<uint32_t>(key >> 32);
      Block& block = blocks_.emplace_back();
      const auto number =
          cache_->views()[view].find({static_cast<int>(key & 0xffff), static_cast<int>(key >> 16 & 0xffff)});
      if (!number) continue;
      const std::optional<BlockTerms> terms = cache_->resident(view, *number);
      block.key = {view, *number};
      block.state = terms ? State::inMemory : State::onDisk;
      if (terms) block.terms = *terms;
    }
  }

  Block& operator[](uint32_t name) { return blocks_[name]; }

  // Asks for some more coefficients of the blocks before `name`, under the lights of who asked for them
  // first: neighbours have nearly the same. Not a call, like the next: for the compiler it would have no
  // effect, and be left out.
  [[gnu::always_inline]] void fetchSome(size_t name) {
    if (lights_.empty() && !begin(name)) return;
    const auto some = lights_.first(std::min(lights_.size(), kLightsAtOnce));
    for (const LightWeight& light : some) __builtin_prefetch(terms_.light(light.light));
    lights_ = lights_.subspan(some.size());
  }
  // For all of them.
  [[gnu::always_inline]] void fetchRest(size_t name) {
    while (!lights_.empty() || begin(name)) {
      for (const LightWeight& light : lights_) __builtin_prefetch(terms_.light(light.light));
      lights_ = {};
    }
  }

private:
  struct Named {
    uint64_t key; // view, row, column
    std::span<const LightWeight> row;
  };
  static constexpr size_t kLightsAtOnce = 8;
  static constexpr int kFirstBits = 10;
  static constexpr uint32_t kFree = ~uint32_t{0};
  static constexpr uint64_t kGolden = 0x9e3779b97f4a7c15; // 2^64 over the golden ratio
  static_assert(largestViewSide / blockSize <= 1 << 16, "sides of a view in blocks");

  // Where the name of a block is, or has to be written.
  uint32_t& slotOf(uint64_t key) {
    size_t slot = key * kGolden >> (64 - bits_);
    while (slots_[slot] != kFree && named_[slots_[slot]].key != key) slot = (slot + 1) % slots_.size();
    return slots_[slot];
  }
  void grow() {
    slots_.assign(size_t{1} << ++bits_, kFree);
    for (uint32_t name = 0; name < named_.size(); ++name) slotOf(named_[name].key) = name;
  }

  // The next block that has coefficients.
  bool begin(size_t name) {
    for (; begun_ < name; ++begun_) {
      if (blocks_[begun_].state != State::inMemory || blocks_[begun_].terms.rank == 0) continue;
      terms_ = blocks_[begun_].terms;
      lights_ = named_[begun_++].row;
      return true;
    }
    return false;
  }

  const BlockCache* cache_;
  int bits_ = kFirstBits;
  std::vector<uint32_t> slots_; // names, by their keys; 2^bits, of which half are free
  std::vector<Named> named_;
  std::vector<Block> blocks_;           // of the names, in order
  BlockTerms terms_;                    // of the block that was begun last
  std::span<const LightWeight> lights_; // of these, still to be asked for
  size_t begun_ = 0;                    // blocks
};

} // namespace surflect
