// Blocks of a set of views that were used lately, decoded.  [Weyrich 2005, §5.3]
//
// [Corbato 1968] A paging experiment with the Multics system, MIT Project MAC. The clock: what is to go is
// looked for round and round; what was asked for since the last time stays for another round.
#pragma once

#include "srf/codec/view_file.h"
#include "surfel/base/progress.h"

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
  uint64_t bytesRead = 0; // as stored, without what lies between them
  uint64_t hits = 0;      // blocks that get found in memory
};

struct BlockKey {
  uint32_t view = 0, block = 0;
  friend auto operator<=>(const BlockKey&, const BlockKey&) = default;
};

class BlockCache {
public:
  // `views` must outlive the cache. Memory exceeds the budget (bytes of decoded blocks) by what callers still
  // hold, by what fetch has brought until trim is called, by 4 bytes for every position of a block in a view,
  // and 48 for the most blocks that ever were in memory.
  BlockCache(std::span<const ViewFile> views, size_t budget);

  std::span<const ViewFile> views() const { return views_; }

  // Never null. Throws Error as ViewFile::read. Safe from many threads at once; two that miss the same block
  // at the same time both read it.
  std::shared_ptr<const Block> get(uint32_t view, uint32_t block);

  // Has these in memory until trim or get is called, whatever the budget. Ascending, each once; all
  // threads read, each a stretch. What was read before something failed is kept, too. Throws Error as
  // ViewFile::read, and Cancelled. Not from many threads.
  void fetch(std::span<const BlockKey> blocks, const Progress& progress);
  // Keeps to the budget again.
  void trim();

  // What follows is safe from many threads at once, but not while any of them calls another method, which may
  // end what is pointed to. It is asked for in no order that a processor could guess: a look-up reads two
  // numbers that depend on each other, and lines of memory that its neighbours read, too.

  // Where a view's blocks are: a place in memory, or one of the last two.
  static constexpr uint32_t kOnDisk = ~uint32_t{1}, kBackground = ~uint32_t{0};
  static constexpr bool isInMemory(uint32_t place) { return place < kOnDisk; }
  struct Grid {
    ViewHeader header;
    int across;                   // blocks, of the header; asked for each look-up
    std::vector<uint32_t> places; // row by row

    uint32_t cellOf(BlockPosition position) const {
      return static_cast<uint32_t>(position.y * across + position.x);
    }
    uint32_t placeOf(BlockPosition position) const { return places[cellOf(position)]; }
  };
  const Grid& grid(uint32_t view) const { return grids_[view]; }

  struct Resident {
    const std::byte* values = nullptr; // as Block has them; null also for those of rank 0
    uint16_t rank = 0, stride = 0;
    mutable bool isWanted = false; // since makeRoom last came by; through atomic_ref

    BlockTerms terms(const ViewHeader& view) const {
      return blockTerms(rank, stride, static_cast<size_t>(view.lights), values);
    }
  };
  // Of a place in memory. Blocks found so stay longer than those that were not.
  const Resident& resident(uint32_t place) const {
    const Resident& found = residents_[place];
    want(found);
    return found;
  }
  // Asks the processor for it. Not a call: for the compiler it would have no effect, and be left out.
  [[gnu::always_inline]] void fetchResident(uint32_t place) const { __builtin_prefetch(&residents_[place]); }

  // The same in one call: empty where the block is not in memory.
  std::optional<BlockTerms> resident(uint32_t view, uint32_t block) const {
    const uint32_t place = placeOf({view, block});
    if (place == kOnDisk) return std::nullopt;
    return resident(place).terms(grids_[view].header);
  }

  CacheCounts counts() const;

private:
  struct Owner {
    BlockKey key;
    std::shared_ptr<const Block> block; // null where the place is free
  };

  static void want(const Resident& resident) {
    const std::atomic_ref isWanted(resident.isWanted);
    if (!isWanted.load(std::memory_order_relaxed)) // many ask for few: their lines stay shared
      isWanted.store(true, std::memory_order_relaxed);
  }
  const uint32_t& placeOf(BlockKey key) const {
    return grids_[key.view].places[views_[key.view].cell(key.block)];
  }
  void put(BlockKey key, uint32_t place) {
    grids_[key.view].places[views_[key.view].cell(key.block)] = place;
  }
  uint32_t insert(BlockKey key, std::shared_ptr<const Block> block); // which is not in memory; its place
  void remove(uint32_t place);
  void makeRoom(uint32_t newest);

  std::span<const ViewFile> views_;
  size_t budget_;
  std::vector<Grid> grids_; // of each view; places are written under the mutex, like residents_
  std::vector<Resident> residents_;
  mutable std::mutex mutex_;   // guards all that follows
  std::vector<Owner> owners_;  // of each place
  std::vector<uint32_t> free_; // places
  size_t hand_ = 0;            // the place that makeRoom looks at next
  size_t memory_ = 0;          // of all blocks, bytes
  CacheCounts counts_;
};

} // namespace surflect::codec
