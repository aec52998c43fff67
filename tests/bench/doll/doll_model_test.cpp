#include "bench/doll/doll_model.h"

#include "bench/doll/doll_shape.h"
#include "bench/doll/frame_times.h"
#include "bench/doll/paper_frame.h"
#include "render/evaluation/measure.h"
#include "render/film/frame_file.h"
#include "srf/model/model.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace surflect::bench {
namespace {

// A small doll in a folder that goes with it.
class DollModel : public testing::Test {
protected:
  DollModel()
      : folder_(std::filesystem::path(testing::TempDir()) /
                testing::UnitTest::GetInstance()->current_test_info()->name()) {
    std::filesystem::remove_all(folder_);
  }
  ~DollModel() override { std::filesystem::remove_all(folder_); }

  model::Model written(const DollSize& size, const std::string& name = "doll") const {
    writeDollModel(folder_ / name, size);
    return model::openModel(folder_ / name);
  }

  std::filesystem::path folder_;
  static constexpr DollSize kSmall{.surfels = 2000, .views = 12, .lights = 6, .width = 100, .height = 132};
};

TEST_F(DollModel, HasTheSizeAskedFor) {
  const model::Model model = written(kSmall);
  EXPECT_NEAR(static_cast<double>(model.cloud.size()), 2000, 200);
  EXPECT_EQ(model.rig.views.size(), 12u);
  EXPECT_EQ(model.rig.lights.size(), 6u);
  EXPECT_TRUE(model.isFullProduct);
  EXPECT_EQ(model.files[0].header().width, 100);
  EXPECT_EQ(model.files[0].header().height, 132);
}

TEST_F(DollModel, BlocksAreThoseOfTheOutline) {
  const model::Model model = written(kSmall);
  for (const size_t view : {0, 5, 11}) {
    const codec::ViewFile& file = model.files[view];
    const auto outline = dollOutline(model.rig.views[view].camera);
    for (int y = 0; y < 132; ++y)
      for (int x = 0; x < 100; ++x) {
        const auto block = file.find({x / codec::blockSize, y / codec::blockSize});
        const int texel = y % codec::blockSize * codec::blockSize + x % codec::blockSize;
        const bool stored = block && (file.read(*block).present >> texel & 1);
        ASSERT_EQ(stored, outline[static_cast<size_t>(y * 100 + x)] == 1) << x << ", " << y;
      }
  }
}

TEST_F(DollModel, WritesIntoNobodysFolder) {
  const auto other = folder_ / "other";
  std::filesystem::create_directories(other);
  writeFileAtomically(other / "notes.txt", "mine");
  EXPECT_THROW(writeDollModel(other, kSmall), Error);
  EXPECT_FALSE(std::filesystem::exists(other / "views"));
}

TEST_F(DollModel, TheSameSeedGivesTheSameModel) {
  EXPECT_EQ(written(kSmall, "a").identity, written(kSmall, "b").identity);
  DollSize other = kSmall;
  other.seed = 2;
  EXPECT_NE(written(kSmall, "a").identity, written(other, "c").identity);
}

TEST_F(DollModel, ARigIsKnownByItsCameras) {
  model::Model model = written(kSmall);
  EXPECT_TRUE(isDoll(model.rig));
  model.rig.views.pop_back();
  EXPECT_FALSE(isDoll(model.rig)); // those of fewer views stand elsewhere
  EXPECT_FALSE(isDoll({}));
}

TEST_F(DollModel, TheSurfaceIsThatOfTheModel) {
  const model::Model model = written(kSmall);
  const DollSurface surface = dollSurface(kSmall.surfels, kSmall.seed, dollCameras(kSmall));
  EXPECT_EQ(surface.cloud.p0, model.cloud.p0);
  EXPECT_EQ(surface.fades.values, model.fades.values);
}

// Also where views are so few that others stand in, and where the warp turns what no view sees to the viewer.
TEST_F(DollModel, FramesAreThoseOfThePaper) {
  for (const size_t views : {2, 5, 12}) {
    DollSize size = kSmall;
    size.views = views;
    const model::Model model = written(size, std::to_string(views));
    const Shot shot = dollShot(model, 160, 120, 3);
    codec::BlockCache cache(model.files, size_t{1} << 28);
    surfels::FrameStats stats;
    const surfels::FrameLayers film =
        surfels::renderFrame(model, *shot.warp, shot.camera, shot.lights, shot.options, cache, stats);
    ResidentBlocks blocks(cache);
    const PaperFrame paper = paperFrame(model, *shot.warp, shot.camera, shot.lights, shot.options, blocks);
    EXPECT_EQ(paper.visible, stats.visible);
    const double white = film::whiteOf(paper.color);
    ASSERT_GT(white, 0);
    EXPECT_GT(evaluation::compare(paper.color, film.color, 1 / white).psnrLinear(), 130) << views;
    for (size_t i = 0; i < paper.color.values.size(); ++i)
      ASSERT_NEAR(paper.color.values[i], film.color.values[i], 2.2e-6 * white);
  }
}

TEST_F(DollModel, CountsAreThoseOfTheFrame) {
  const model::Model model = written(kSmall);
  const Shot shot = dollShot(model, 160, 120, 3);
  codec::BlockCache cache(model.files, size_t{1} << 28);
  const FrameTimes times = timeFrames(model, shot, cache, size_t{1} << 28, 3);
  const FrameCounts& counts = times.counts;
  EXPECT_EQ(counts.surfels, model.cloud.size());
  EXPECT_GT(counts.visible, counts.surfels / 4);
  EXPECT_LE(counts.visible, counts.drawn);
  EXPECT_LT(counts.drawn, counts.surfels);
  EXPECT_GT(counts.pairs, counts.visible);
  EXPECT_LE(counts.pairs, 4 * counts.visible);
  EXPECT_LE(counts.lookups, counts.pairs * model.rig.lights.size());
  EXPECT_GT(counts.contributions, counts.visible);
  EXPECT_EQ(counts.blocks, cache.counts().reads); // none twice
  EXPECT_GT(counts.rank, 1);
  EXPECT_GT(times.coldSeconds, 0);
  double stages = 0;
  for (const std::string_view stage : kStages) stages += times.stages.find(stage)->second.best;
  EXPECT_LE(stages, times.frame.best * 1.0001);
  EXPECT_LE(times.frame.best, times.frame.median);
}

} // namespace
} // namespace surflect::bench
