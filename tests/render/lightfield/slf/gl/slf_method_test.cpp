#include "render/lightfield/slf/slf_method.h"

#include "render/lightfield/common/views.h"
#include "render/lightfield/slf/build.h"
#include "render/lightfield/slf/field_file.h"
#include "render/lightfield/slf/reference.h"
#include "tests/support/synthetic_capture.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace surflect::slf {
namespace {

constexpr int kSize = 48;

// A matte sphere, built once.
class SlfMethodTest : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<image::TemporaryFolder>();
    studio::photograph({.cameras = 30, .lights = 0, .size = kSize}, *folder_ / "capture");
    build(lightfield::Views(*folder_ / "capture"),
          {.regions = 20, .texels = 4000, .directions = 18, .tolerance = 0}, *folder_ / "field");
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static scene::Scene sceneFrom(const Vec3<double>& direction, const warp::Warp& warp) {
    return {warp, studio::cameraFrom<ObjectSpace>(direction, kSize), {}};
  }

  static std::unique_ptr<method::Renderer> opened(const method::Setting& setting = {}) {
    return slfMethod().open(*folder_ / "field", setting, {});
  }

  static inline std::unique_ptr<image::TemporaryFolder> folder_;
  const warp::WarpPointer rest_ = warp::chainWarp({});
};

TEST_F(SlfMethodTest, ShowsTheObjectFromNewViewpoints) {
  const auto renderer = opened({{"samples", 1}});
  for (const Vec3<double>& direction :
       {Vec3<double>(1, 2, 3), Vec3<double>(-3, 0.5, 1), Vec3<double>(0, -1, 0.1)}) {
    const image::Image found = renderer->render(sceneFrom(direction, *rest_)).color;
    const auto camera = studio::cameraFrom<AcquisitionSpace>(direction, kSize);
    const image::Image truth = studio::overBlack(studio::viewSphere(camera, 1), studio::fixedRadiance);
    ASSERT_EQ(found.values.size(), truth.values.size());
    double squares = 0;
    size_t covered = 0;
    for (size_t i = 0; i < truth.values.size(); i += 4) {
      if (truth.values[i + 3] == 0 || found.values[i + 3] == 0) continue;
      ++covered;
      for (size_t channel = 0; channel < 3; ++channel)
        squares += std::pow(static_cast<double>(truth.values[i + channel] - found.values[i + channel]), 2);
    }
    EXPECT_GT(covered, 800u);
    EXPECT_LE(std::sqrt(squares / (3 * static_cast<double>(covered))), 0.02);
  }
}

TEST_F(SlfMethodTest, AgreesWithTheReferenceOnAStoredField) {
  const auto renderer = opened({{"samples", 1}});
  const OpenedField opened = openField(*folder_ / "field");
  const Reference reference(opened.field, *opened.textures);
  const image::Image found = renderer->render(sceneFrom({2, 1, 1}, *rest_)).color;
  const image::Image expected =
      reference.render(studio::cameraFrom<AcquisitionSpace>({2, 1, 1}, kSize)).color;
  size_t different = 0;
  for (size_t i = 0; i < expected.values.size(); ++i)
    different += std::abs(found.values[i] - expected.values[i]) > 1e-4f;
  EXPECT_LE(different, 8u); // two pixels at the silhouette
}

TEST_F(SlfMethodTest, DescribesItself) {
  const auto renderer = opened();
  const method::Description& description = renderer->describe();
  EXPECT_EQ(description.rig.views.size(), 30u);
  EXPECT_GE(description.counts.at("regions"), 10u);
  EXPECT_GT(description.counts.at("textures"), description.counts.at("regions"));
  EXPECT_EQ(description.counts.at("texture_slots"), description.counts.at("textures"));
  EXPECT_EQ(opened({{"cache_mb", 0}})->describe().counts.at("texture_slots"), kLeastSlots);
  EXPECT_EQ(description.points.size(), openField(*folder_ / "field").field.mesh.positions.size());
  EXPECT_LT(description.middle.raw().norm(), 0.05);
  EXPECT_NE(description.identity, opened({{"samples", 1}})->describe().identity);
  EXPECT_NE(description.identity, opened({{"stages", "two"}})->describe().identity);
  EXPECT_EQ(description.identity, opened({{"cache_mb", 0}})->describe().identity);
}

TEST_F(SlfMethodTest, ReportsWhatAFrameTook) {
  const auto renderer = opened();
  const method::FrameReport first = renderer->render(sceneFrom({1, 0, 0}, *rest_)).report;
  const method::FrameReport second = renderer->render(sceneFrom({1, 0, 0}, *rest_)).report;
  EXPECT_LT(first.counts.at("passes"), 0.5 * first.counts.at("passes_all"));
  EXPECT_EQ(first.counts.at("texture_misses"), first.counts.at("passes"));
  EXPECT_EQ(second.counts.at("texture_misses"), 0);
  EXPECT_GT(first.seconds.at("draw"), 0);
  EXPECT_FALSE(first.remark.has_value());
}

TEST_F(SlfMethodTest, APixelWithinTheObjectHasAlphaOneForAnyNumberOfSamples) {
  for (int samples = 1; samples <= 8; ++samples) {
    const auto renderer = opened({{"samples", samples}});
    const image::Image color = renderer->render(sceneFrom({1, 2, 3}, *rest_)).color;
    EXPECT_EQ(color.at(kSize / 2, kSize / 2)[3], 1) << samples;
    for (size_t i = 3; i < color.values.size(); i += 4) EXPECT_LE(color.values[i], 1) << samples;
  }
}

TEST_F(SlfMethodTest, AovsAreThoseThatAreAsked) {
  const auto renderer = opened();
  const scene::Scene scene = sceneFrom({1, 2, 3}, *rest_);
  EXPECT_TRUE(renderer->render(scene).aovs.empty());
  const auto layers = renderer->render(scene, {"depth", "observed", "normal"});
  ASSERT_EQ(layers.aovs.size(), 2u);
  const image::Image &depth = layers.aovs.at("depth"), &observed = layers.aovs.at("observed");
  const auto middle = static_cast<size_t>(kSize / 2 * kSize + kSize / 2);
  EXPECT_NEAR(depth.values[middle], studio::cameraDistance - 1, 0.05);
  EXPECT_TRUE(std::isinf(depth.values[0]));
  EXPECT_GT(observed.values[middle], 0.5f);
  EXPECT_EQ(observed.values[0], 0);
}

} // namespace
} // namespace surflect::slf
