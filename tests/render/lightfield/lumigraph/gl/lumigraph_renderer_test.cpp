#include "render/lightfield/lumigraph/lumigraph_renderer.h"

#include "render/lightfield/common/views.h"
#include "render/lightfield/lumigraph/build.h"
#include "tests/support/synthetic_capture.h"

#include <cmath>
#include <memory>
#include <optional>

namespace surflect::lumigraph {
namespace {

// A matte sphere, built once.
class LumigraphRendererTest : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<image::TemporaryFolder>();
    studio::photograph({.cameras = 30, .lights = 0, .size = 48}, *folder_ / "capture");
    build(lightfield::Views(*folder_ / "capture"), {.slabs = {.nodes = 3, .texels = 100000}},
          *folder_ / "lumigraph");
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static scene::Scene sceneFrom(const Vec3<double>& direction, const warp::Warp& warp) {
    return {warp, studio::cameraFrom<ObjectSpace>(direction, 48), {}};
  }

  static inline std::unique_ptr<image::TemporaryFolder> folder_;
  const warp::WarpPointer rest_ = warp::chainWarp({});
};

TEST_F(LumigraphRendererTest, ShowsTheObjectFromNewViewpoints) {
  LumigraphRenderer renderer(*folder_ / "lumigraph");
  for (const Vec3<double>& direction :
       {Vec3<double>(1, 2, 3), Vec3<double>(-3, 0.5, 1), Vec3<double>(0, -1, 0.1)}) {
    const method::FrameLayers layers = renderer.render(sceneFrom(direction, *rest_));
    const auto camera = studio::cameraFrom<AcquisitionSpace>(direction, 48);
    const studio::SphereView view = studio::viewSphere(camera, 1);
    const image::Image truth = studio::overBlack(view, studio::fixedRadiance);
    ASSERT_EQ(layers.color.values.size(), truth.values.size());
    double squares = 0;
    size_t covered = 0;
    for (size_t i = 0; i < truth.values.size(); i += 4) {
      if (truth.values[i + 3] == 0 || layers.color.values[i + 3] == 0) continue;
      ++covered;
      for (size_t channel = 0; channel < 3; ++channel)
        squares +=
            std::pow(static_cast<double>(truth.values[i + channel] - layers.color.values[i + channel]), 2);
    }
    EXPECT_GT(covered, 800u);
    EXPECT_LE(std::sqrt(squares / (3 * static_cast<double>(covered))), 0.02);
  }
}

TEST_F(LumigraphRendererTest, DescribesItself) {
  const LumigraphRenderer renderer(*folder_ / "lumigraph");
  const method::Description& description = renderer.describe();
  EXPECT_EQ(description.rig.views.size(), 30u);
  EXPECT_EQ(description.counts.at("nodes"), 3u);
  EXPECT_LE(description.counts.at("texels"), 100000u);
  EXPECT_FALSE(description.points.empty());
  EXPECT_LE(length(description.middle - Point(0, 0, 0)), 1e-3);
}

TEST_F(LumigraphRendererTest, RefusesOtherLights) {
  LumigraphRenderer renderer(*folder_ / "lumigraph");
  scene::Scene scene = sceneFrom({0, 0, 1}, *rest_);
  scene.lights.push_back(scene::ShotDirectionalLight{{0, 0, 1}, {1, 1, 1}});
  EXPECT_THROW(renderer.render(scene), Error);
}

TEST_F(LumigraphRendererTest, SeveralStandSideBySideWithTheirOwnOptions) {
  LumigraphRenderer one(*folder_ / "lumigraph"), other(*folder_ / "lumigraph");
  LumigraphOptions options;
  options.samples = 2;
  LumigraphRenderer fine(*folder_ / "lumigraph", options);
  const scene::Scene scene = sceneFrom({1, 1, 1}, *rest_);
  EXPECT_EQ(one.render(scene).color.values, other.render(scene).color.values);
  EXPECT_NE(one.render(scene).color.values, fine.render(scene).color.values);
  EXPECT_NE(fine.describe().identity, one.describe().identity);
  const auto two = fine.render(scene).color.values;
  fine.turn({{"samples", 1}});
  EXPECT_EQ(fine.render(scene).color.values, one.render(scene).color.values);
  fine.turn({});
  EXPECT_EQ(fine.render(scene).color.values, two);
}

TEST_F(LumigraphRendererTest, GivesDepthIfAskedAndSaysIfNothingIsVisible) {
  LumigraphRenderer renderer(*folder_ / "lumigraph");
  scene::Scene scene = sceneFrom({0, 0, 1}, *rest_);
  const method::FrameLayers layers = renderer.render(scene, {"depth"});
  EXPECT_FALSE(layers.report.remark);
  EXPECT_NEAR(layers.aovs.at("depth").at(24, 24)[0], scene.camera.center().raw().norm() - 1, 0.01);
  EXPECT_TRUE(renderer.render(scene).aovs.empty());
  // The camera looks away from the object.
  const Mat3<double> turned = Vec3<double>(-1, 1, -1).asDiagonal();
  scene.camera.cameraFromWorld = {turned * scene.camera.cameraFromWorld.rotation(),
                                  turned * scene.camera.cameraFromWorld.translation()};
  EXPECT_EQ(renderer.render(scene).report.remark, "no part of the object is visible");
}

TEST_F(LumigraphRendererTest, OptionsOutOfRangeAreErrors) {
  LumigraphOptions options;
  for (const int samples : {0, 9}) {
    options.samples = samples;
    EXPECT_THROW(LumigraphRenderer(*folder_ / "lumigraph", options), Error);
  }
}

} // namespace
} // namespace surflect::lumigraph
