#include "srf/store/block_cache.h"

#include <cassert>

namespace surflect {

std::shared_ptr<const Block> BlockCache::get(uint32_t view, uint32_t block) {
  assert(view < views_.size());
  const uint64_t key = uint64_t{view} << 32 | block;
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = entryOf_.find(key); found != entryOf_.end()) {
      entries_.splice(entries_.begin(), entries_, found->second);
      ++counts_.hits;
      return found->second->block;
    }
  }

  const auto read = std::make_shared<const Block>(views_[view].read(block));

  const std::lock_guard lock(mutex_);
  ++counts_.reads;
  counts_.bytesRead += views_[view].storedBytes(block);
  if (entryOf_.contains(key)) return read; // another thread was faster
  entries_.push_front({key, read});
  entryOf_[key] = entries_.begin();
  memory_ += read->memory();
  while (memory_ > budget_) {
    memory_ -= entries_.back().block->memory();
    entryOf_.erase(entries_.back().key);
    entries_.pop_back();
  }
  return read;
}

CacheCounts BlockCache::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

} // namespace surflect
