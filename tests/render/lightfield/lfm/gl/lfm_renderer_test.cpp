#include "render/lightfield/lfm/lfm_renderer.h"

#include "tests/render/lightfield/lfm/synthetic_maps.h"
#include "tests/support/synthetic_capture.h"

#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace surflect::lfm {
namespace {

using namespace lfm::testing;

constexpr int kSize = 48;

// Maps of random numbers on a sphere, written once.
class LfmRendererTest : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<image::TemporaryFolder>();
    studio::photograph({.cameras = 3, .lights = 0, .size = kSize}, *folder_ / "capture");
    writeMaps(syntheticMaps(bumpySphere(6, 8)), capture::readCapture(*folder_ / "capture"),
              *folder_ / "maps");
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static scene::Scene sceneFrom(const Vec3<double>& direction, const warp::Warp& warp) {
    return {warp, studio::cameraFrom<ObjectSpace>(direction, kSize), {}};
  }

  static inline std::unique_ptr<image::TemporaryFolder> folder_;
  const warp::WarpPointer rest_ = warp::chainWarp({});
};

TEST_F(LfmRendererTest, ShowsTheFramesOfItsMaps) {
  LfmRenderer renderer(*folder_ / "maps"), first(*folder_ / "maps", {.frame = {.terms = 1}});
  const LightFieldMaps maps = openMaps(*folder_ / "maps").maps;
  FrameRenderer frames(maps, gl::contextOfThread()->describe().limits);
  const auto camera = studio::cameraFrom<AcquisitionSpace>({1, 2, 3}, kSize);
  const scene::Scene scene = sceneFrom({1, 2, 3}, *rest_);
  EXPECT_EQ(renderer.render(scene).color.values, frames.render(camera).color.values);
  EXPECT_EQ(first.render(scene).color.values, frames.render(camera, {.terms = 1}).color.values);
}

TEST_F(LfmRendererTest, DescribesItself) {
  const LfmRenderer renderer(*folder_ / "maps");
  const method::Description& description = renderer.describe();
  EXPECT_EQ(description.rig.views.size(), 3u);
  EXPECT_EQ(description.counts.at("terms"), 3u);
  EXPECT_EQ(description.points.size(), openMaps(*folder_ / "maps").maps.mesh.positions.size());
  const std::string identity = description.identity;
  EXPECT_NE(identity, LfmRenderer(*folder_ / "maps", {.samples = 2}).describe().identity);
  EXPECT_NE(identity, LfmRenderer(*folder_ / "maps", {.frame = {.terms = 2}}).describe().identity);
  EXPECT_EQ(identity, LfmRenderer(*folder_ / "maps", {.frame = {.terms = 3}}).describe().identity);
}

TEST_F(LfmRendererTest, ReportsWhatAFrameTook) {
  LfmRenderer renderer(*folder_ / "maps", {.frame = {.passes = Passes::perTerm}});
  const method::FrameReport report = renderer.render(sceneFrom({1, 0, 0}, *rest_)).report;
  EXPECT_EQ(report.counts.at("passes"), 4);
  EXPECT_EQ(report.counts.at("terms"), 3);
  EXPECT_GT(report.counts.at("texture_bytes"), 0);
  EXPECT_GT(report.seconds.at("draw"), 0);
  EXPECT_FALSE(report.remark.has_value());
  scene::Scene turned = sceneFrom({1, 0, 0}, *rest_);
  turned.camera.cameraFromWorld =
      Rigid<CameraSpace, CameraSpace>(Eigen::AngleAxisd(3.14159, Vec3<double>::UnitY()).toRotationMatrix(),
                                      Vec3<double>::Zero()) *
      turned.camera.cameraFromWorld;
  EXPECT_EQ(renderer.render(turned).report.remark, "no part of the object is visible");
}

TEST_F(LfmRendererTest, SeveralSamplesAreAveragedAndTheNearestDepthKept) {
  LfmRenderer single(*folder_ / "maps"), several(*folder_ / "maps", {.samples = 2});
  const scene::Scene scene = sceneFrom({1, 2, 3}, *rest_);
  EXPECT_TRUE(single.render(scene, {"observed"}).aovs.empty());
  const method::FrameLayers one = single.render(scene, {"depth"}), four = several.render(scene, {"depth"});
  size_t partly = 0;
  for (size_t i = 0; i < one.color.values.size(); i += 4) {
    const float alpha = four.color.values[i + 3];
    EXPECT_EQ(alpha * 4, std::round(alpha * 4));
    EXPECT_EQ(alpha == 0, std::isinf(four.aovs.at("depth").values[i / 4]));
    partly += alpha > 0 && alpha < 1;
    if (alpha == 1) {
      EXPECT_EQ(one.color.values[i + 3], 1);
    }
  }
  EXPECT_GT(partly, 50u);
  const auto middle = static_cast<size_t>(kSize / 2 * kSize + kSize / 2);
  EXPECT_NEAR(one.aovs.at("depth").values[middle], studio::cameraDistance - 1, 0.15);
  EXPECT_EQ(image::errorOf([&] { LfmRenderer(*folder_ / "maps", {.samples = 9}); }),
            "samples: found 9, expected 1..8");
}

TEST_F(LfmRendererTest, LightsAndWarpsAreRefused) {
  LfmRenderer renderer(*folder_ / "maps");
  scene::Scene lit = sceneFrom({1, 0, 0}, *rest_);
  lit.lights.emplace_back(scene::ShotDirectionalLight{{0, 0, 1}, {1, 1, 1}});
  EXPECT_THROW(renderer.render(lit), Error);
  const warp::WarpPointer larger = warp::scaleWarp({2, 2, 2}, {0, 0, 0});
  EXPECT_THROW(renderer.render(sceneFrom({1, 0, 0}, *larger)), Error);
  EXPECT_THROW(LfmRenderer(*folder_ / "capture"), Error);
}

} // namespace
} // namespace surflect::lfm
