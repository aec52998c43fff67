#include "srf/store/block_cache.h"

#include <cassert>
#include <limits>

namespace surflect {

static_assert(2 * 3 * blockTexels <= std::numeric_limits<uint16_t>::max(), "the stride of a resident block");

BlockCache::BlockCache(std::span<const ViewFile> views, size_t budget) : views_(views), budget_(budget) {
  for (const ViewFile& view : views) residents_.emplace_back(view.blockCount());
}

std::shared_ptr<const Block> BlockCache::get(uint32_t view, uint32_t block) {
  assert(view < views_.size() && block < views_[view].blockCount());
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
  Resident& resident = residentOf(key);
  resident.values = read->values.data();
  resident.rank = static_cast<uint16_t>(read->rank);
  resident.stride = static_cast<uint16_t>(read->stride);
  resident.isHere = true;
  memory_ += read->memory();
  makeRoom();
  return read;
}

void BlockCache::makeRoom() {
  while (memory_ > budget_) {
    const auto last = std::prev(entries_.end());
    Resident& resident = residentOf(last->key);
    if (resident.isWanted.exchange(false)) {
      entries_.splice(std::next(entries_.begin()), entries_, last); // what was read just now stays first
      continue;
    }
    resident.isHere = false;
    memory_ -= last->block->memory();
    entryOf_.erase(last->key);
    entries_.pop_back();
  }
}

CacheCounts BlockCache::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

} // namespace surflect
