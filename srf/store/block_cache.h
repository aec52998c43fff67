// The most recently used blocks of a set of views, decoded.  [Weyrich 2005, §5.3]
#pragma once

#include "srf/store/view_file.h"
#include "surfel/progress.h"

#include <atomic>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

namespace surflect {

struct CacheCounts {
  uint64_t reads = 0;     // blocks taken from disk
  uint64_t bytesRead = 0; // as stored
  uint64_t hits = 0;
};

struct BlockKey {
  uint32_t view = 0, block = 0;
  friend auto operator<=>(const BlockKey&, const BlockKey&) = default;
};

class BlockCache {
public:
  // `views` must outlive the cache. Memory exceeds the budget (bytes of decoded blocks) by what callers still
  // hold, by what fetch has brought until trim is called, and by 16 bytes for every block of the views, in
  // memory or not.
  BlockCache(std::span<const ViewFile> views, size_t budget);

  std::span<const ViewFile> views() const { return views_; }

  // Never null. Throws Error as ViewFile::read. Safe from many threads at once; two that miss the same block
  // at the same time both read it.
  std::shared_ptr<const Block> get(uint32_t view, uint32_t block);

  // Has these in memory until trim or get is called, whatever the budget. Ascending, each once; in this order
  // they are read, by all threads. Throws Error as ViewFile::read, and Cancelled. Not from many threads.
  void fetch(std::span<const BlockKey> blocks, const Progress& progress);
  // Keeps to the budget again.
  void trim();

  // Empty where the block is not in memory. Safe from many threads at once, but not while any of them calls
  // another method, which may end what is pointed to. Blocks found so stay longer than those that were not,
  // but keep their order.
  std::optional<BlockTerms> resident(uint32_t view, uint32_t block) const {
    const Resident& found = residents_[view][block];
    if (!found.isHere) return std::nullopt;
    if (!found.isWanted.load(std::memory_order_relaxed)) // many ask for few: their lines stay shared
      found.isWanted.store(true, std::memory_order_relaxed);
    const auto lights = static_cast<size_t>(views_[view].header().lights);
    return blockTerms(found.rank, found.stride, lights, found.values);
  }

  CacheCounts counts() const;

private:
  struct Entry {
    BlockKey key;
    std::shared_ptr<const Block> block;
  };
  // All that resident reads, in one place: it is asked for in no order that a processor could guess.
  struct Resident {
    const std::byte* values = nullptr; // as Block has them; null also for those of rank 0
    uint16_t rank = 0, stride = 0;
    bool isHere = false;
    mutable std::atomic<bool> isWanted = false; // by resident, since makeRoom last passed over it
  };
  struct Hash {
    size_t operator()(BlockKey key) const { return uint64_t{key.view} << 32 | key.block; }
  };
  Resident& residentOf(BlockKey key) { return residents_[key.view][key.block]; }
  void announce(std::span<const BlockKey> blocks) const;
  void insert(BlockKey key, std::shared_ptr<const Block> block); // which is not in memory
  void makeRoom();

  std::span<const ViewFile> views_;
  size_t budget_;
  std::vector<std::vector<Resident>> residents_; // of each view's blocks; written under the mutex
  mutable std::mutex mutex_;                     // guards all that follows
  std::list<Entry> entries_;                     // most recently used first
  std::unordered_map<BlockKey, std::list<Entry>::iterator, Hash> entryOf_;
  size_t memory_ = 0; // of all entries, bytes
  CacheCounts counts_;
};

} // namespace surflect
