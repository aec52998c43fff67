#include "render/surfels/reference.h"

#include "bench/doll/doll_model.h"
#include "bench/doll/doll_shot.h"
#include "render/evaluation/measure.h"
#include "render/film/frame_file.h"
#include "surfel/base/error.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace surflect::surfels {
namespace {

class Reference : public ::testing::Test {
protected:
  ~Reference() override { std::filesystem::remove_all(folder_); }
  model::Model doll(size_t views) const {
    std::filesystem::remove_all(folder_);
    bench::writeDollModel(folder_,
                          {.surfels = 2000, .views = views, .lights = 6, .width = 100, .height = 132});
    return model::openModel(folder_);
  }
  std::filesystem::path folder_ = std::filesystem::path(::testing::TempDir()) /
                                  ::testing::UnitTest::GetInstance()->current_test_info()->name();
};

// Includes so few views that fallback views are used, and warps that turn unseen parts towards the viewer.
TEST_F(Reference, RenderFrameShowsTheReferenceFrame) {
  for (const size_t views : {2, 5, 12}) {
    const model::Model model = doll(views);
    const bench::Shot shot = bench::dollShot(model.cloud, 160, 120, 3);
    FrameWorkspace workspace(model, size_t{1} << 28);
    const image::Image fast =
        renderFrame(model, {*shot.warp, shot.camera, shot.lights}, shot.options, workspace).color;
    const ReferenceFrame reference =
        referenceFrame(model, *shot.warp, shot.camera, shot.lights, shot.options, workspace.cache);
    EXPECT_EQ(reference.visible, workspace.stats.visible);
    const double white = film::whiteOf(reference.color);
    ASSERT_GT(white, 0);
    EXPECT_GT(evaluation::compare(reference.color, fast, 1 / white).psnrLinear(), 130) << views;
    for (size_t i = 0; i < fast.values.size(); ++i)
      ASSERT_NEAR(reference.color.values[i], fast.values[i], 2.2e-6 * white);
  }
}

TEST_F(Reference, TakesNoEnvironment) {
  const model::Model model = doll(2);
  const bench::Shot shot = bench::dollShot(model.cloud, 32, 24, 1);
  codec::BlockCache cache(model.files, size_t{1} << 28);
  const scene::ShotLight light{std::in_place_type<scene::ShotEnvironment>};
  EXPECT_THROW(referenceFrame(model, *shot.warp, shot.camera, {&light, 1}, shot.options, cache), Error);
}

} // namespace
} // namespace surflect::surfels
