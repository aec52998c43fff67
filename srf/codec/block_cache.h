// Cache of recently used blocks, decoded, over a set of view files.  [Weyrich 2005, §5.3]
//
// Eviction is the clock algorithm [Corbato 1968, A Paging Experiment with the Multics System]: a hand circles
// over the blocks, spares each one used since its last pass, and evicts the first that was not.
#pragma once

#include "srf/codec/view_file.h"
#include "surfel/base/time.h"

#include <atomic>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

namespace surflect::codec {

struct CacheCounts {
  uint64_t reads = 0;     // blocks taken from disk
  uint64_t bytesRead = 0; // as stored, without gaps
  uint64_t hits = 0;      // blocks found in memory
};

struct BlockKey {
  uint32_t view = 0, block = 0;
  friend auto operator<=>(const BlockKey&, const BlockKey&) = default;
};

class BlockCache {
public:
  // `views` must outlive the cache; `budget` is in bytes of decoded blocks. Memory exceeds the budget by
  // blocks that callers still hold, by blocks fetched since the last trim, by 4 bytes for each cell of a
  // view's grid, and by 48 bytes for each block of the largest number ever in memory.
  BlockCache(std::span<const ViewFile> views, size_t budget);

  std::span<const ViewFile> views() const { return views_; }

  // Returns a block, read from disk if it is not in memory; never null. Throws Error as ViewFile::read. Safe
  // from many threads at once; two threads that miss the same block at the same time both read it.
  std::shared_ptr<const Block> get(uint32_t view, uint32_t block);

  // Reads blocks into memory and keeps them until trim or get is called, even beyond the budget. `blocks`
  // must ascend without repeats. Reads stretches of blocks in parallel; if one fails, the blocks already read
  // stay. Throws Error as ViewFile::read, and Cancelled. Only one thread may call it.
  void fetch(std::span<const BlockKey> blocks, const Progress& progress);
  // Evicts blocks until the budget is kept again.
  void trim();

  // The methods below are safe from many threads at once, but not while a thread calls one of the methods
  // above, which may invalidate their pointers. A look-up reaches blocks in random order, so it reads only
  // two dependent numbers, on cache lines that neighbouring look-ups share.

  // Places of blocks: an index into the residents, or kOnDisk, or kBackground for a cell without a block.
  static constexpr uint32_t kOnDisk = ~uint32_t{1}, kBackground = ~uint32_t{0};
  static constexpr bool isInMemory(uint32_t place) { return place < kOnDisk; }
  struct Grid {
    ViewHeader header;
    int across;                   // header.blocksAcross(), which every look-up needs
    std::vector<uint32_t> places; // row by row

    uint32_t cellOf(BlockPosition position) const {
      return static_cast<uint32_t>(position.y * across + position.x);
    }
    uint32_t placeOf(BlockPosition position) const { return places[cellOf(position)]; }
  };
  const Grid& grid(uint32_t view) const { return grids_[view]; }

  struct Resident {
    const std::byte* values = nullptr; // as Block::values; null if the rank is 0
    uint16_t rank = 0, stride = 0;
    mutable bool isReferenced = false; // used since evict's last pass; accessed through atomic_ref

    BlockTerms terms(const ViewHeader& view) const {
      return blockTerms(rank, stride, static_cast<size_t>(view.lights), values);
    }
  };
  // The block at a place in memory; marks it as used.
  const Resident& resident(uint32_t place) const {
    const Resident& found = residents_[place];
    want(found);
    return found;
  }
  // Prefetches the entry of resident(). Always inlined: compilers drop a call
  // whose only effect is prefetching.
  [[gnu::always_inline]] void prefetchEntry(uint32_t place) const { __builtin_prefetch(&residents_[place]); }

  // The factors of a block, or nothing if it is not in memory.
  std::optional<BlockTerms> resident(uint32_t view, uint32_t block) const {
    const uint32_t place = placeOf({view, block});
    if (place == kOnDisk) return std::nullopt;
    return resident(place).terms(grids_[view].header);
  }

  CacheCounts counts() const;

private:
  struct Owner {
    BlockKey key;
    std::shared_ptr<const Block> block; // null if the place is free
  };

  static void want(const Resident& resident) {
    const std::atomic_ref isReferenced(resident.isReferenced);
    if (!isReferenced.load(std::memory_order_relaxed)) // write only once, so that the line stays shared
      isReferenced.store(true, std::memory_order_relaxed);
  }
  const uint32_t& placeOf(BlockKey key) const {
    return grids_[key.view].places[views_[key.view].cell(key.block)];
  }
  void put(BlockKey key, uint32_t place) {
    grids_[key.view].places[views_[key.view].cell(key.block)] = place;
  }
  // Adds a block that is not in memory; returns its place.
  uint32_t insert(BlockKey key, std::shared_ptr<const Block> block);
  void remove(uint32_t place);
  void evict(uint32_t newest);

  std::span<const ViewFile> views_;
  size_t budget_;
  std::vector<Grid> grids_; // one per view; places are written under the mutex, like residents_
  std::vector<Resident> residents_;
  mutable std::mutex mutex_;   // guards the members below
  std::vector<Owner> owners_;  // one per place
  std::vector<uint32_t> free_; // unused places
  size_t hand_ = 0;            // the place that evict examines next
  size_t memory_ = 0;          // bytes of all blocks
  CacheCounts counts_;
};

} // namespace surflect::codec
