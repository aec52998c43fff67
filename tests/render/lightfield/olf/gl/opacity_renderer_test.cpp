#include "render/lightfield/olf/opacity_renderer.h"

#include "render/lightfield/common/views.h"
#include "render/lightfield/olf/build.h"
#include "srf/image/resize.h"
#include "tests/support/synthetic_capture.h"

#include <cmath>
#include <memory>

namespace surflect::olf {
namespace {

// A matte sphere, built once.
class OpacityRendererTest : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<image::TemporaryFolder>();
    studio::photograph({.cameras = 40, .lights = 0, .size = 48}, *folder_ / "capture");
    for (const auto& [name, method] : {std::pair("vdtm", Method::vdtm), {"ulr", Method::ulr}}) {
      lightfield::Views views(*folder_ / "capture");
      build(views, {.method = method}, *folder_ / name);
    }
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static scene::Scene sceneFrom(const Vec3<double>& direction, const warp::Warp& warp) {
    return {warp, studio::cameraFrom<ObjectSpace>(direction, 48), {}};
  }

  static inline std::unique_ptr<image::TemporaryFolder> folder_;
  const warp::WarpPointer rest_ = warp::chainWarp({});
};

TEST_F(OpacityRendererTest, ShowsTheObjectAndItsOutlineFromNewViewpoints) {
  for (const char* name : {"vdtm", "ulr"}) {
    OpacityRenderer renderer(*folder_ / name, {.samples = 2, .order = {}});
    for (const Vec3<double>& direction : {Vec3<double>(1, 2, 3), Vec3<double>(-3, 0.5, 1)}) {
      const method::FrameLayers layers = renderer.render(sceneFrom(direction, *rest_));
      const auto camera = studio::cameraFrom<AcquisitionSpace>(direction, 48);
      const image::Image truth = studio::overBlack(studio::viewSphere(camera, 3), studio::fixedRadiance);
      double squares = 0;
      for (size_t i = 0; i < truth.values.size(); ++i)
        squares += std::pow(static_cast<double>(truth.values[i] - layers.color.values[i]), 2);
      const double rms = std::sqrt(squares / static_cast<double>(truth.values.size()));
      RecordProperty(name, std::to_string(rms));
      EXPECT_LE(rms, 0.06) << name;
    }
  }
}

TEST_F(OpacityRendererTest, EqualScenesHaveEqualBits) {
  OpacityRenderer one(*folder_ / "vdtm"), other(*folder_ / "vdtm");
  const scene::Scene scene = sceneFrom({1, 1, 1}, *rest_);
  other.render(sceneFrom({-1, 0, 2}, *rest_));
  EXPECT_EQ(one.render(scene).color.values, other.render(scene).color.values);
}

TEST_F(OpacityRendererTest, DescribesItselfAndTakesTheSamplesKnob) {
  OpacityRenderer renderer(*folder_ / "ulr", {.samples = 2, .order = Order::peel});
  EXPECT_EQ(renderer.describe().counts.at("views"), 40u);
  EXPECT_EQ(renderer.describe().counts.at("pieces"), renderer.describe().counts.at("triangles"));
  EXPECT_LE(length(renderer.describe().middle - Point3<AcquisitionSpace, double>(0, 0, 0)), 0.05);
  const std::string before = renderer.describe().identity;
  EXPECT_NE(before.find("peel"), std::string::npos);
  renderer.turn({{"samples", 1}});
  EXPECT_NE(renderer.describe().identity, before);
  EXPECT_THROW(renderer.turn({{"terms", 1}}), Error);
}

TEST_F(OpacityRendererTest, MeansOfSamplesAreThoseOfTheLargerPicture) {
  OpacityRenderer renderer(*folder_ / "vdtm", {.samples = 3, .order = {}});
  const scene::Scene scene = sceneFrom({1, 2, 3}, *rest_);
  const image::Image means = renderer.render(scene).color;
  renderer.turn({{"samples", 1}});
  scene::Scene larger = scene;
  larger.camera.lens = capture::resized(scene.camera.lens, 3 * 48, 3 * 48);
  const image::Image expected = image::squareMeans(renderer.render(larger).color, 3);
  ASSERT_EQ(means.values.size(), expected.values.size());
  for (size_t i = 0; i < means.values.size(); ++i) EXPECT_NEAR(means.values[i], expected.values[i], 1e-6f);
}

TEST_F(OpacityRendererTest, ReportsStagesAndWhatItKeepsInMemory) {
  for (const auto& [name, order] : {std::pair("vdtm", Order::bsp), {"ulr", Order::list}}) {
    OpacityRenderer renderer(*folder_ / name, {.samples = 1, .order = order});
    const auto& counts = renderer.describe().counts;
    const bool isVdtm = renderer.describe().counts.at("triangulation_bytes") > 0;
    EXPECT_EQ(isVdtm, name == std::string("vdtm"));
    EXPECT_EQ(counts.at("bsp_tree_bytes") > 0, order == Order::bsp);
    EXPECT_EQ(counts.at("blend_bytes"), sizeof(TriangleBlend) * counts.at("triangles"));
    EXPECT_EQ(counts.at("matrix_bytes"), 64 * counts.at("views"));
    size_t sum = 0;
    for (const char* part : {"triangulation_bytes", "direction_bytes", "visible_view_bytes", "corner_bytes",
                             "bsp_tree_bytes", "piece_bytes", "blend_bytes", "matrix_bytes"})
      sum += counts.at(part);
    EXPECT_EQ(counts.at("auxiliary_bytes"), sum);
    const auto seconds = renderer.render(sceneFrom({1, 2, 3}, *rest_)).report.seconds;
    EXPECT_EQ(seconds.contains("order"), order == Order::bsp);
    for (const char* stage : {"closest views", "blends", "upload", "draw", "read"})
      EXPECT_TRUE(seconds.contains(stage)) << stage;
  }
}

TEST_F(OpacityRendererTest, RefusesOtherLightsAndSaysIfNothingIsVisible) {
  OpacityRenderer renderer(*folder_ / "vdtm");
  scene::Scene scene = sceneFrom({0, 0, 1}, *rest_);
  const Mat3<double> turned = Vec3<double>(-1, 1, -1).asDiagonal();
  scene.camera.cameraFromWorld = {turned * scene.camera.cameraFromWorld.rotation(),
                                  turned * scene.camera.cameraFromWorld.translation()};
  EXPECT_EQ(renderer.render(scene).report.remark, "no part of the object is visible");
  scene.lights.push_back(scene::ShotDirectionalLight{{0, 0, 1}, {1, 1, 1}});
  EXPECT_THROW(renderer.render(scene), Error);
  EXPECT_THROW(OpacityRenderer(*folder_ / "vdtm", {.samples = 9, .order = {}}), Error);
}

} // namespace
} // namespace surflect::olf
