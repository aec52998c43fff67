// The most recently used blocks of a set of views, decoded.  [Weyrich 2005, §5.3]
#pragma once

#include "srf/store/view_file.h"

#include <atomic>
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

class BlockCache {
public:
  // `views` must outlive the cache. Blocks that callers still hold do not count against the budget (bytes of
  // decoded blocks): with one block in use a thread, memory exceeds it by at most one block a thread,
  // and by 16 bytes for every block of the views, in memory or not.
  BlockCache(std::span<const ViewFile> views, size_t budget);

  std::span<const ViewFile> views() const { return views_; }

  // Never null. Throws Error as ViewFile::read. Safe from many threads at once; two that miss the same block
  // at the same time both read it.
  std::shared_ptr<const Block> get(uint32_t view, uint32_t block);

  // Empty where the block is not in memory. Safe from many threads at once, but not while any of them calls
  // get, which may end what is pointed to. Blocks found so stay longer than those that were not, but keep
  // their order.
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
    uint64_t key; // view, block
    std::shared_ptr<const Block> block;
  };
  // All that resident reads, in one place: it is asked for in no order that a processor could guess.
  struct Resident {
    const std::byte* values = nullptr; // as Block has them; null also for those of rank 0
    uint16_t rank = 0, stride = 0;
    bool isHere = false;
    mutable std::atomic<bool> isWanted = false; // by resident, since makeRoom last passed over it
  };
  Resident& residentOf(uint64_t key) { return residents_[key >> 32][static_cast<uint32_t>(key)]; }
  void makeRoom();

  std::span<const ViewFile> views_;
  size_t budget_;
  std::vector<std::vector<Resident>> residents_; // of each view's blocks; written under the mutex
  mutable std::mutex mutex_;                     // guards all that follows
  std::list<Entry> entries_;                     // most recently used first
  std::unordered_map<uint64_t, std::list<Entry>::iterator> entryOf_;
  size_t memory_ = 0; // of all entries, bytes
  CacheCounts counts_;
};

} // namespace surflect
