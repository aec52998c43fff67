#include "srf/store/asked_blocks.h"

#include "tests/srf/store/synthetic.h"

namespace surflect {
namespace {

using synthetic::glossySphere;

constexpr int lights = 6, views = 4;

class AskedBlocksTest : public testing::Test {
protected:
  AskedBlocksTest() {
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
  void expectIsRight(const AskedBlocks::Block& found, uint32_t view, BlockPosition position,
                     const BlockCache& cache) const {
    using State = AskedBlocks::State;
    const auto number = views_[view].find(position);
    ASSERT_EQ(found.state == State::background, !number.has_value());
    if (!number) return;
    EXPECT_EQ(found.key, (BlockKey{view, *number}));
    const auto terms = cache.resident(view, *number);
    ASSERT_EQ(found.state == State::inMemory, terms.has_value());
    if (!terms) return;
    EXPECT_EQ(found.terms.coefficients, terms->coefficients);
    EXPECT_EQ(found.terms.levels, terms->levels);
    EXPECT_EQ(found.terms.stride, terms->stride);
    EXPECT_EQ(found.terms.rank, terms->rank);
  }

  TemporaryFolder folder_;
  std::vector<ViewFile> views_;
};

// Half of them are in memory.
TEST_F(AskedBlocksTest, AreTheBlocksOfTheCache) {
  BlockCache cache(views_, 1 << 30);
  for (uint32_t view = 0; view < views; ++view)
    for (uint32_t block = 0; block < views_[view].blockCount(); block += 2) cache.get(view, block);
  AskedBlocks blocks(cache);
  std::mt19937 generator(1);
  const std::vector<LightWeight> row{{0, {1, 1, 1}}, {lights - 1, {1, 1, 1}}};
  for (int round = 0; round < 100; ++round) {
    struct Question {
      uint32_t view;
      BlockPosition position;
      uint32_t name;
    };
    std::vector<Question> asked;
    for (int i = 0; i < 200; ++i) {
      const auto view = static_cast<uint32_t>(generator() % views);
      const BlockPosition position = randomPosition(view, generator);
      asked.push_back({view, position, blocks.nameOf(view, position, row)});
    }
    blocks.findAll();
    for (const auto& [view, position, name] : asked) {
      expectIsRight(blocks[name], view, position, cache);
      blocks.fetchSome(name + 1);
    }
    blocks.fetchRest(blocks.named());
  }
}

// Also where they are far more than there were places for at first.
TEST_F(AskedBlocksTest, EachHasOneName) {
  const BlockCache cache(views_, 0);
  AskedBlocks blocks(cache);
  uint32_t count = 0;
  for (int twice = 0; twice < 2; ++twice) {
    uint32_t expected = 0;
    for (uint32_t view = 0; view < views; ++view)
      for (int y = 0; y < views_[view].header().blocksDown(); ++y)
        for (int x = 0; x < views_[view].header().blocksAcross(); ++x)
          ASSERT_EQ(blocks.nameOf(view, {x, y}, {}), expected++);
    count = expected;
    blocks.findAll();
  }
  EXPECT_EQ(blocks.named(), count);
  EXPECT_GT(count, 2048u);
}

} // namespace
} // namespace surflect
