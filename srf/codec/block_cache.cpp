#include "srf/codec/block_cache.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <functional>
#include <iterator>
#include <limits>
#include <utility>

namespace surflect::codec {

static_assert(2 * 3 * blockTexels <= std::numeric_limits<uint16_t>::max(), "the stride of a resident block");

BlockCache::BlockCache(std::span<const ViewFile> views, size_t budget) : views_(views), budget_(budget) {
  for (const ViewFile& view : views) {
    const ViewHeader& header = view.header();
    std::vector<uint32_t> places(header.cells(), kBackground);
    for (uint32_t block = 0; block < view.blockCount(); ++block) places[view.cell(block)] = kOnDisk;
    grids_.push_back({header, header.blocksAcross(), std::move(places)});
  }
}

std::shared_ptr<const Block> BlockCache::get(uint32_t view, uint32_t block) {
  assert(view < views_.size() && block < views_[view].blockCount());
  const uint32_t& place = placeOf({view, block});
  {
    const std::lock_guard lock(mutex_);
    if (place != kOnDisk) {
      want(residents_[place]);
      ++counts_.hits;
      return owners_[place].block;
    }
  }

  const auto read = std::make_shared<const Block>(views_[view].read(block));

  const std::lock_guard lock(mutex_);
  ++counts_.reads;
  counts_.bytesRead += views_[view].storedBytes(block);
  if (place == kOnDisk) evict(insert({view, block}, read)); // unless another thread inserted it first
  return read;
}

void BlockCache::fetch(std::span<const BlockKey> blocks, const Progress& progress) {
  assert(std::ranges::adjacent_find(blocks, std::greater_equal()) == blocks.end());
  std::vector<BlockKey> missing;
  std::ranges::copy_if(blocks, std::back_inserter(missing),
                       [&](BlockKey key) { return placeOf(key) == kOnDisk; });
  std::vector<uint32_t> numbers;
  for (const BlockKey& key : missing) numbers.push_back(key.block);
  struct Stretch {
    const ViewFile& file;
    size_t begin;
    std::span<const uint32_t> blocks;
  };
  std::vector<Stretch> stretches;
  for (size_t begin = 0, viewEnd = 0; begin < missing.size(); begin += stretches.back().blocks.size()) {
    const uint32_t view = missing[begin].view;
    while (viewEnd < missing.size() && missing[viewEnd].view == view) ++viewEnd;
    const std::span ofView = std::span(numbers).subspan(begin, viewEnd - begin);
    stretches.push_back({views_[view], begin, ofView.first(views_[view].readRunLength(ofView))});
    views_[view].adviseRead(stretches.back().blocks);
  }
  std::vector<std::shared_ptr<const Block>> read(missing.size());
  const auto keep = [&] {
    const std::lock_guard lock(mutex_);
    for (size_t i = 0; i < missing.size(); ++i) {
      if (!read[i]) continue;
      ++counts_.reads;
      counts_.bytesRead += views_[missing[i].view].storedBytes(missing[i].block);
      insert(missing[i], std::move(read[i]));
    }
  };
  try {
    tbb::parallel_for(size_t{0}, stretches.size(), [&](size_t s) {
      progress.checkpoint();
      const auto& [file, begin, ofStretch] = stretches[s];
      file.read(ofStretch, [&, first = begin](size_t i, Block block) {
        read[first + i] = std::make_shared<const Block>(std::move(block));
      });
    });
  } catch (...) {
    keep();
    throw;
  }
  keep();
}

void BlockCache::trim() {
  const std::lock_guard lock(mutex_);
  evict(kOnDisk);
}

uint32_t BlockCache::insert(BlockKey key, std::shared_ptr<const Block> block) {
  auto place = static_cast<uint32_t>(owners_.size());
  if (free_.empty()) {
    // Reserves, so that remove cannot throw.
    if (free_.capacity() <= owners_.size()) free_.reserve(2 * owners_.size() + 1);
    residents_.emplace_back();
    owners_.emplace_back();
  } else {
    place = free_.back();
    free_.pop_back();
  }
  residents_[place] = {block->values.data(), static_cast<uint16_t>(block->rank),
                       static_cast<uint16_t>(block->stride)};
  put(key, place);
  memory_ += block->memory();
  owners_[place] = {key, std::move(block)};
  return place;
}

void BlockCache::remove(uint32_t place) {
  auto& [key, block] = owners_[place];
  put(key, kOnDisk);
  memory_ -= block->memory();
  block = nullptr;
  free_.push_back(place);
}

// Evicts blocks until the budget is kept; the block at `newest` is evicted last.
void BlockCache::evict(uint32_t newest) {
  while (memory_ > budget_) {
    const auto place = static_cast<uint32_t>(hand_);
    hand_ = (hand_ + 1) % owners_.size();
    if (!owners_[place].block) continue;
    const bool isLast = free_.size() + 1 == owners_.size();
    if (isLast || (place != newest && !std::exchange(residents_[place].isReferenced, false))) remove(place);
  }
}

CacheCounts BlockCache::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

} // namespace surflect::codec
