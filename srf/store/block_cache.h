// The most recently used blocks of a set of views, decoded.  [Weyrich 2005, §5.3]
#pragma once

#include "srf/store/view_file.h"

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <unordered_map>

namespace surflect {

struct CacheCounts {
  uint64_t reads = 0;     // blocks taken from disk
  uint64_t bytesRead = 0; // as stored
  uint64_t hits = 0;
};

class BlockCache {
public:
  // `views` must outlive the cache. Blocks that callers still hold do not count against the budget (bytes of
  // decoded blocks): with one block in use a thread, memory exceeds it by at most one block a thread.
  BlockCache(std::span<const ViewFile> views, size_t budget) : views_(views), budget_(budget) {}

  std::span<const ViewFile> views() const { return views_; }

  // Never null. Throws Error as ViewFile::read. Safe from many threads at once; two that miss the same block
  // at the same time both read it.
  std::shared_ptr<const Block> get(uint32_t view, uint32_t block);

  CacheCounts counts() const;

private:
  struct Entry {
    uint64_t key;
    std::shared_ptr<const Block> block;
  };

  std::span<const ViewFile> views_;
  size_t budget_;
  mutable std::mutex mutex_; // guards all that follows
  std::list<Entry> entries_; // most recently used first
  std::unordered_map<uint64_t, std::list<Entry>::iterator> entryOf_;
  size_t memory_ = 0; // of all entries, bytes
  CacheCounts counts_;
};

} // namespace surflect
