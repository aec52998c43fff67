#include "srf/shading/executor.h"

#include "srf/shading/taps.h"
#include "tests/srf/codec/synthetic.h"

namespace surflect::shading {
namespace {

// Many look-ups in few blocks.
class ExecutorTest : public ::testing::Test {
protected:
  ExecutorTest() {
    writeFileAtomically(folder_ / "0.view",
                        codec::encodeView(codec::synthetic::glossySphere(64, 3), {.tolerance = 0.01}).file);
    views_.emplace_back(folder_ / "0.view");
    std::mt19937 generator(1);
    std::uniform_real_distribution<float> anywhere(0, 64);
    for (const uint32_t light : {0, 2}) rows_.add(light, {1, 1, 1});
    for (uint32_t target = 0; target < 1000; ++target)
      ops_.push_back({target, 0, anywhere(generator), anywhere(generator), 1, 0, 2});
  }

  // Executes operations with resident blocks; sorts the blocks that the others need.
  ExecutedPart executed(codec::BlockCache& cache) const {
    ExecutedPart part;
    part.begin({ops_, &rows_, ops_.size()});
    const Progress progress;
    Executor(cache, progress).executeResident(part);
    std::ranges::sort(part.needed);
    return part;
  }
  // Blocks of the view that an operation reads.
  std::vector<codec::BlockKey> blocksOf(const ShadingOp& op) const {
    std::vector<codec::BlockKey> blocks;
    forEachBlock(TexelPosition::at(views_[0].header(), op.x, op.y), [&](codec::BlockPosition position) {
      if (const auto block = views_[0].find(position)) blocks.push_back({0, *block});
    });
    return blocks;
  }

  image::TemporaryFolder folder_;
  std::vector<codec::ViewFile> views_;
  weights::LightRows rows_;
  std::vector<ShadingOp> ops_;
};

TEST_F(ExecutorTest, NotesEachBlockThatIsWaitedForOnceWhereTheyAreFew) {
  codec::BlockCache cache(views_, 0);
  const ExecutedPart part = executed(cache);
  EXPECT_EQ(part.waiting.size() + part.lost, ops_.size());
  EXPECT_EQ(std::ranges::adjacent_find(part.needed), part.needed.end());
  EXPECT_EQ(part.needed.size(), views_[0].blockCount()); // all were requested
}

// Resident blocks might be evicted before the missing ones arrive.
TEST_F(ExecutorTest, WhatWaitsForOneBlockNotesAllThatItLooksInto) {
  codec::BlockCache cache(views_, size_t{1} << 30);
  for (uint32_t block = 0; block < views_[0].blockCount(); block += 2) cache.get(0, block);
  const ExecutedPart part = executed(cache);
  std::vector<uint32_t> waiting;
  std::vector<codec::BlockKey> needed;
  uint64_t tasks = 0;
  for (uint32_t i = 0; i < ops_.size(); ++i) {
    const std::vector<codec::BlockKey> blocks = blocksOf(ops_[i]);
    if (std::ranges::none_of(blocks, [](codec::BlockKey key) { return key.block % 2 != 0; })) {
      tasks += blocks.size();
      continue;
    }
    waiting.push_back(i);
    needed.insert(needed.end(), blocks.begin(), blocks.end());
  }
  std::ranges::sort(needed);
  needed.erase(std::ranges::unique(needed).begin(), needed.end());
  EXPECT_EQ(part.waiting, waiting);
  EXPECT_EQ(part.needed, needed);
  EXPECT_EQ(part.tasks, tasks);
  EXPECT_TRUE(std::ranges::any_of(needed, [](codec::BlockKey key) { return key.block % 2 == 0; }));
}

} // namespace
} // namespace surflect::shading
