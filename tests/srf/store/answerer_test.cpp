#include "srf/store/answerer.h"

#include "tests/srf/store/synthetic.h"

namespace surflect {
namespace {

// Many look-ups, few blocks, none of which is in memory.
TEST(Answerer, NotesEachBlockThatIsWaitedForOnceWhereTheyAreFew) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder / "0.view";
  writeFileAtomically(path, encodeView(synthetic::glossySphere(64, 3), {.tolerance = 0.01}).file);
  std::vector<ViewFile> views;
  views.emplace_back(path);
  BlockCache cache(views, 0);
  std::mt19937 generator(1);
  std::uniform_real_distribution<float> anywhere(0, 64);
  LightRows rows;
  for (const uint32_t light : {0, 2}) rows.add(light, {1, 1, 1});
  std::vector<ShadingOp> ops;
  for (uint32_t target = 0; target < 1000; ++target)
    ops.push_back({target, 0, anywhere(generator), anywhere(generator), 1, 0, 2});

  AnsweredPart part;
  part.begin({ops, &rows, ops.size()});
  const Progress progress;
  Answerer(cache, bestSimd(), progress).answerResident(part);
  EXPECT_EQ(part.waiting.size() + part.lost, ops.size());
  std::ranges::sort(part.needed);
  EXPECT_EQ(std::ranges::adjacent_find(part.needed), part.needed.end());
  EXPECT_EQ(part.needed.size(), views[0].blockCount()); // all were asked for
}

} // namespace
} // namespace surflect
