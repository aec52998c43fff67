#include "bench/doll/doll_model.h"

#include "bench/doll/doll_shape.h"
#include "bench/doll/doll_shot.h"
#include "srf/model/model.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace surflect::bench {
namespace {

// A small doll model in a temporary folder.
class DollModel : public ::testing::Test {
protected:
  DollModel()
      : folder_(std::filesystem::path(::testing::TempDir()) /
                ::testing::UnitTest::GetInstance()->current_test_info()->name()) {
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

TEST_F(DollModel, TheSurfaceIsThatOfTheModel) {
  const model::Model model = written(kSmall);
  const DollSurface surface = dollSurface(kSmall.surfels, kSmall.seed, dollCameras(kSmall));
  EXPECT_EQ(surface.cloud.p0, model.cloud.p0);
  EXPECT_EQ(surface.visibility.values, model.visibility.values);
}

TEST_F(DollModel, EveryOtherViewKeepsWhatBelongsToIt) {
  const model::Model model = written({.surfels = 500, .views = 9, .lights = 4, .width = 64, .height = 80});
  const model::Model part = everyView(model, 2);
  ASSERT_EQ(part.rig.views.size(), 5u);
  ASSERT_EQ(part.files.size(), 5u);
  ASSERT_EQ(part.columns.size(), 5u);
  ASSERT_EQ(part.rig.frames.size(), 20u);
  ASSERT_EQ(part.visibility.values.size(), 5 * model.cloud.size());
  EXPECT_TRUE(part.isFullProduct);
  EXPECT_EQ(part.cloud.p0, model.cloud.p0);
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(part.rig.views[i].identity, model.rig.views[2 * i].identity);
    EXPECT_EQ(part.files[i].checksum(), model.files[2 * i].checksum());
    EXPECT_EQ(part.columns[i], model.columns[2 * i]);
    for (size_t surfel = 0; surfel < model.cloud.size(); ++surfel)
      ASSERT_EQ(part.visibility.of(surfel)[i], model.visibility.of(surfel)[2 * i]);
  }
  for (const capture::Frame& frame : part.rig.frames)
    EXPECT_EQ(frame.picture, model::viewFilePath(2 * frame.view)); // named as in the doll's rig
}

} // namespace
} // namespace surflect::bench
