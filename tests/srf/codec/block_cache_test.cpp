#include "srf/codec/block_cache.h"

#include "tests/srf/codec/synthetic.h"

#include <fstream>
#include <thread>

namespace surflect::codec {
namespace {

using synthetic::glossySphere;

class BlockCacheTest : public ::testing::Test {
protected:
  BlockCacheTest() {
    for (const char* name : {"a.view", "b.view"}) {
      writeFileAtomically(folder_ / name, encodeView(glossySphere(40, 6), {}).file);
      views_.emplace_back(folder_ / name);
    }
  }
  uint32_t blockCount() const { return static_cast<uint32_t>(views_[0].blockCount()); }
  // Requests every block of both views in order.
  void sweep(BlockCache& cache) const {
    for (uint32_t view = 0; view < 2; ++view)
      for (uint32_t block = 0; block < blockCount(); ++block) cache.get(view, block);
  }

  // Expects the cached block to equal the one in its file.
  static void expectResident(BlockCache& cache, const std::vector<ViewFile>& views, BlockKey key) {
    const auto resident = cache.resident(key.view, key.block);
    ASSERT_TRUE(resident);
    const Block read = views[key.view].read(key.block);
    EXPECT_EQ(resident->rank, read.rank);
    const auto bytes = read.values.bytes();
    EXPECT_TRUE(
        std::equal(bytes.begin(), bytes.end(), reinterpret_cast<const std::byte*>(resident->coefficients)));
  }

  // Flips the last bit of a block's record.
  void corrupt(uint32_t view, uint32_t block) const {
    auto end = static_cast<std::streamoff>(std::filesystem::file_size(views_[view].path()));
    for (uint32_t b = blockCount() - 1; b > block; --b)
      end -= static_cast<std::streamoff>(views_[view].storedBytes(b));
    std::fstream file(views_[view].path(), std::ios::in | std::ios::out | std::ios::binary);
    file.seekg(end - 1);
    const int byte = file.get();
    file.seekp(end - 1);
    file.put(static_cast<char>(byte ^ 1));
  }

  image::TemporaryFolder folder_;
  std::vector<ViewFile> views_;
};

TEST_F(BlockCacheTest, ReturnsWhatTheFileHolds) {
  BlockCache cache(views_, 1 << 30);
  for (int pass = 0; pass < 2; ++pass) {
    for (uint32_t block = 0; block < blockCount(); ++block) {
      EXPECT_EQ(cache.get(1, block)->values, views_[1].read(block).values);
    }
  }
}

TEST_F(BlockCacheTest, RoomForAllReadsEachBlockOnce) {
  BlockCache cache(views_, 1 << 30);
  sweep(cache);
  sweep(cache);
  uint64_t bytes = 0;
  for (uint32_t block = 0; block < blockCount(); ++block) bytes += 2 * views_[0].storedBytes(block);
  EXPECT_EQ(cache.counts().reads, 2 * blockCount());
  EXPECT_EQ(cache.counts().hits, 2 * blockCount());
  EXPECT_EQ(cache.counts().bytesRead, bytes);
}

TEST_F(BlockCacheTest, WithoutRoomEveryRequestReads) {
  BlockCache cache(views_, 0);
  for (int i = 0; i < 3; ++i) EXPECT_GT(cache.get(0, 3)->rank, 0);
  EXPECT_EQ(cache.counts().reads, 3u);
  EXPECT_EQ(cache.counts().hits, 0u);
}

TEST_F(BlockCacheTest, WhatWasAskedForLatelyStays) {
  const auto memory = [&](uint32_t block) { return views_[0].read(block).memory(); };
  BlockCache cache(views_, memory(1) + std::max(memory(2), memory(3)));
  cache.get(0, 1);
  cache.get(0, 2);
  cache.get(0, 1);
  cache.get(0, 3); // replaces block 2
  EXPECT_EQ(cache.counts().hits, 1u);
  cache.get(0, 1);
  cache.get(0, 3);
  EXPECT_EQ(cache.counts().hits, 3u);
  cache.get(0, 2);
  EXPECT_EQ(cache.counts().hits, 3u);
}

TEST_F(BlockCacheTest, WhatIsResidentIsFoundUntilItGoes) {
  BlockCache cache(views_, 1 << 30);
  EXPECT_FALSE(cache.resident(1, 3));
  const auto block = cache.get(1, 3);
  const auto resident = cache.resident(1, 3);
  ASSERT_TRUE(resident);
  EXPECT_EQ(resident->rank, block->rank);
  EXPECT_EQ(resident->stride, block->stride);
  EXPECT_EQ(resident->coefficients, block->terms().coefficients);
  EXPECT_EQ(resident->levels, block->terms().levels);
  EXPECT_FALSE(cache.resident(0, 3));

  BlockCache none(views_, 0);
  none.get(1, 3);
  EXPECT_FALSE(none.resident(1, 3));
}

TEST_F(BlockCacheTest, WhatWasFoundStaysLongerThanWhatWasNot) {
  const auto memory = [&](uint32_t block) { return views_[0].read(block).memory(); };
  BlockCache cache(views_, memory(1) + memory(2) + memory(3));
  for (const uint32_t block : {1, 2, 3}) cache.get(0, block);
  ASSERT_TRUE(cache.resident(0, 1)); // least recently used
  cache.get(0, 4);
  EXPECT_FALSE(cache.resident(0, 2));
  EXPECT_TRUE(cache.resident(0, 1));

  BlockCache wanted(views_, memory(2) + std::max(memory(1), memory(3)));
  for (const uint32_t block : {1, 2}) wanted.get(0, block);
  for (const uint32_t block : {1, 2}) ASSERT_TRUE(wanted.resident(0, block));
  wanted.get(0, 3); // must evict one of them
  EXPECT_FALSE(wanted.resident(0, 1));
  EXPECT_TRUE(wanted.resident(0, 3));
}

TEST_F(BlockCacheTest, WhatIsFetchedIsThereUntilRoomIsMade) {
  const std::vector<BlockKey> some{{0, 1}, {0, 2}, {1, 2}, {1, 5}};
  BlockCache cache(views_, views_[0].read(1).memory());
  cache.get(0, 2);
  cache.fetch(some, {});
  EXPECT_EQ(cache.counts().reads, 4u); // one was in memory
  for (const BlockKey& key : some) expectResident(cache, views_, key);
  cache.trim();
  EXPECT_LE(std::ranges::count_if(some, [&](BlockKey key) { return !!cache.resident(key.view, key.block); }),
            1);
}

TEST_F(BlockCacheTest, WhatCannotBeReadIsNotFetched) {
  BlockCache cache(views_, 1 << 30);
  corrupt(1, 4);
  const std::vector<BlockKey> some{{0, 1}, {1, 4}};
  EXPECT_THROW(cache.fetch(some, {}), Error);
  EXPECT_FALSE(cache.resident(1, 4));
  EXPECT_LE(cache.counts().reads, 1u); // a second read only if another thread had reached it
  EXPECT_EQ(cache.resident(0, 1).has_value(), cache.counts().reads == 1);
  cache.fetch(std::vector<BlockKey>{{0, 1}, {0, 2}}, {});
  EXPECT_EQ(cache.counts().reads, 2u);
}

TEST_F(BlockCacheTest, WhatIsReadBeforeADamagedNeighbourIsKept) {
  corrupt(0, 7);
  std::vector<ViewFile> damaged; // opened again: a file that is written to while it is open is refused
  for (const ViewFile& view : views_) damaged.emplace_back(view.path());
  BlockCache cache(damaged, 1 << 30);
  const std::vector<BlockKey> neighbours{{0, 6}, {0, 7}, {0, 8}};
  try {
    cache.fetch(neighbours, {});
    FAIL();
  } catch (const Error& error) {
    const auto [x, y] = views_[0].position(7);
    EXPECT_EQ(error.field(), "block (" + std::to_string(x) + ", " + std::to_string(y) + ").checksum");
  }
  EXPECT_TRUE(cache.resident(0, 6));
  EXPECT_FALSE(cache.resident(0, 7));
  EXPECT_FALSE(cache.resident(0, 8));
  EXPECT_EQ(cache.counts().reads, 1u);
}

// More blocks than one stretch, some of them already in memory.
TEST_F(BlockCacheTest, ManyBlocksOfSeveralViewsAreFetched) {
  std::vector<ViewFile> views;
  for (const char* name : {"c.view", "d.view"}) {
    writeFileAtomically(folder_ / name, encodeView(glossySphere(120, 2), {}).file);
    views.emplace_back(folder_ / name);
  }
  ASSERT_GT(views[0].blockCount(), 2 * 64u);
  BlockCache cache(views, 1 << 30);
  std::vector<BlockKey> all;
  for (uint32_t view = 0; view < 2; ++view)
    for (uint32_t block = 0; block < views[view].blockCount(); ++block) all.push_back({view, block});
  for (size_t i = 0; i < all.size(); i += 37) cache.get(all[i].view, all[i].block);
  cache.fetch(all, {});
  EXPECT_EQ(cache.counts().reads, all.size());
  for (const BlockKey& key : all) expectResident(cache, views, key);
}

TEST_F(BlockCacheTest, BlocksInUseSurviveTheirEviction) {
  BlockCache cache(views_, 0);
  const auto held = cache.get(0, 3);
  sweep(cache);
  EXPECT_EQ(held->values, views_[0].read(3).values);
}

TEST_F(BlockCacheTest, ThreadsMayAskAtOnce) {
  BlockCache cache(views_, 3 * views_[0].read(3).memory());
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < 4; ++t) threads.emplace_back([&] { sweep(cache); });
  }
  EXPECT_EQ(cache.counts().reads + cache.counts().hits, 4u * 2 * blockCount());
}

} // namespace
} // namespace surflect::codec
