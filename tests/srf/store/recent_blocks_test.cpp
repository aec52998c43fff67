#include "srf/store/recent_blocks.h"

#include "tests/srf/store/synthetic.h"

namespace surflect {
namespace {

using synthetic::glossySphere;

constexpr int lights = 6, views = 4;

class RecentBlocksTest : public testing::Test {
protected:
  RecentBlocksTest() {
    for (int v = 0; v < views; ++v) {
      const std::filesystem::path path = folder_ / (std::to_string(v) + ".view");
      writeFileAtomically(path, encodeView(glossySphere(200 + 8 * v, lights), {.tolerance = 0.01}).file);
      views_.emplace_back(path);
    }
  }

  BlockPosition randomPosition(uint32_t view, std::mt19937& generator) const {
    const ViewHeader& header = views_[view].header();
    return {static_cast<int>(generator() % header.blocksAcross()),
            static_cast<int>(generator() % header.blocksDown())};
  }
  // As file and cache say.
  void expectIsRight(const RecentBlocks::Found& found, uint32_t view, BlockPosition position,
                     const BlockCache& cache) const {
    const auto number = views_[view].find(position);
    ASSERT_EQ(found.isStored, number.has_value());
    if (!number) return;
    EXPECT_EQ(found.number, *number);
    const auto terms = cache.resident(view, *number);
    ASSERT_EQ(found.terms.has_value(), terms.has_value());
    if (!terms) return;
    EXPECT_EQ(found.terms->coefficients, terms->coefficients);
    EXPECT_EQ(found.terms->levels, terms->levels);
    EXPECT_EQ(found.terms->stride, terms->stride);
    EXPECT_EQ(found.terms->rank, terms->rank);
  }

  TemporaryFolder folder_;
  std::vector<ViewFile> views_;
};

// Far more than it remembers, of which half are in memory; also ones that it found before.
TEST_F(RecentBlocksTest, AreTheBlocksOfTheCache) {
  BlockCache cache(views_, 1 << 30);
  for (uint32_t view = 0; view < views; ++view)
    for (uint32_t block = 0; block < views_[view].blockCount(); block += 2) cache.get(view, block);
  RecentBlocks blocks(cache);
  std::mt19937 generator(1);
  for (int i = 0; i < 20'000; ++i) {
    const auto view = static_cast<uint32_t>(generator() % views);
    const BlockPosition position = randomPosition(view, generator);
    for (int twice = 0; twice < 2; ++twice) {
      expectIsRight(blocks.at(view, position), view, position, cache);
      blocks.fetchSome();
    }
  }
}

TEST_F(RecentBlocksTest, FourThatMeetAreThereTogether) {
  const BlockCache cache(views_, 0);
  RecentBlocks blocks(cache);
  std::mt19937 generator(2);
  for (int i = 0; i < 1000; ++i) {
    const auto view = static_cast<uint32_t>(generator() % views);
    const BlockPosition first = randomPosition(view, generator);
    if (first.x + 1 == views_[view].header().blocksAcross() ||
        first.y + 1 == views_[view].header().blocksDown())
      continue;
    std::vector<const RecentBlocks::Found*> found;
    for (const int y : {first.y, first.y + 1})
      for (const int x : {first.x, first.x + 1}) found.push_back(&blocks.at(view, {x, y}));
    for (size_t k = 0; k < 4; ++k)
      expectIsRight(*found[k], view, {first.x + static_cast<int>(k % 2), first.y + static_cast<int>(k / 2)},
                    cache);
  }
}

TEST_F(RecentBlocksTest, WhatIsNotedStaysUntilTheBlockIsForgotten) {
  const BlockCache cache(views_, 0);
  RecentBlocks blocks(cache);
  EXPECT_FALSE(blocks.at(1, {12, 12}).isNeeded);
  blocks.at(1, {12, 12}).isNeeded = true;
  EXPECT_FALSE(blocks.at(1, {13, 12}).isNeeded);
  EXPECT_FALSE(blocks.at(2, {12, 12}).isNeeded);
  EXPECT_TRUE(blocks.at(1, {12, 12}).isNeeded);
  for (const uint32_t other : {0, 2, 3}) // far more than it remembers
    for (int y = 0; y < views_[other].header().blocksDown(); ++y)
      for (int x = 0; x < views_[other].header().blocksAcross(); ++x) blocks.at(other, {x, y});
  EXPECT_FALSE(blocks.at(1, {12, 12}).isNeeded);
}

} // namespace
} // namespace surflect
