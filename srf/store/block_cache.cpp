#include "srf/store/block_cache.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <functional>
#include <iterator>
#include <limits>

namespace surflect {

static_assert(2 * 3 * blockTexels <= std::numeric_limits<uint16_t>::max(), "the stride of a resident block");

BlockCache::BlockCache(std::span<const ViewFile> views, size_t budget) : views_(views), budget_(budget) {
  for (const ViewFile& view : views) residents_.emplace_back(view.blockCount());
}

std::shared_ptr<const Block> BlockCache::get(uint32_t view, uint32_t block) {
  assert(view < views_.size() && block < views_[view].blockCount());
  const BlockKey key{view, block};
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
  insert(key, read);
  makeRoom();
  return read;
}

void BlockCache::fetch(std::span<const BlockKey> blocks, const Progress& progress) {
  assert(std::ranges::adjacent_find(blocks, std::greater_equal()) == blocks.end());
  std::vector<BlockKey> missing;
  std::ranges::copy_if(blocks, std::back_inserter(missing),
                       [&](BlockKey key) { return !residentOf(key).isHere; });
  announce(missing);
  std::vector<std::shared_ptr<const Block>> read(missing.size());
  tbb::parallel_for(size_t{0}, missing.size(), [&](size_t i) {
    progress.checkpoint();
    read[i] = std::make_shared<const Block>(views_[missing[i].view].read(missing[i].block));
  });
  const std::lock_guard lock(mutex_);
  for (size_t i = 0; i < missing.size(); ++i) {
    ++counts_.reads;
    counts_.bytesRead += views_[missing[i].view].storedBytes(missing[i].block);
    insert(missing[i], std::move(read[i]));
  }
}

void BlockCache::trim() {
  const std::lock_guard lock(mutex_);
  makeRoom();
}

// Ascending.
void BlockCache::announce(std::span<const BlockKey> blocks) const {
  std::vector<uint32_t> ofView;
  for (size_t i = 0; i < blocks.size(); ++i) {
    ofView.push_back(blocks[i].block);
    if (i + 1 < blocks.size() && blocks[i + 1].view == blocks[i].view) continue;
    views_[blocks[i].view].announce(ofView);
    ofView.clear();
  }
}

void BlockCache::insert(BlockKey key, std::shared_ptr<const Block> block) {
  Resident& resident = residentOf(key);
  resident.values = block->values.data();
  resident.rank = static_cast<uint16_t>(block->rank);
  resident.stride = static_cast<uint16_t>(block->stride);
  resident.isHere = true;
  memory_ += block->memory();
  entries_.push_front({key, std::move(block)});
  entryOf_[key] = entries_.begin();
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
