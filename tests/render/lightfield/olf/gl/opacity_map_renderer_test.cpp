#include "render/lightfield/olf/opacity_map_renderer.h"

#include "render/lightfield/common/views.h"
#include "render/lightfield/olf/opacity_map_build.h"
#include "render/lightfield/olf/opacity_map_file.h"
#include "tests/srf/image/files.h"
#include "tests/support/synthetic_capture.h"

#include <cmath>
#include <memory>
#include <set>
#include <string>

namespace surflect::olf {
namespace {

// Maps of a matte sphere, built once.
class OpacityMapRendererTest : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<image::TemporaryFolder>();
    studio::photograph({.cameras = 40, .lights = 0, .size = 48}, *folder_ / "capture");
    lightfield::Views views(*folder_ / "capture");
    MapBuildReport report;
    writeMaps(buildMaps(views, {.mesh = {.triangles = 1000}, .order = Order::peel}, report), views.capture(),
              *folder_ / "maps");
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static scene::Scene sceneFrom(const Vec3<double>& direction, const warp::Warp& warp) {
    return {warp, studio::cameraFrom<ObjectSpace>(direction, 48), {}};
  }

  static inline std::unique_ptr<image::TemporaryFolder> folder_;
  const warp::WarpPointer rest_ = warp::chainWarp({});
};

TEST_F(OpacityMapRendererTest, ShowsTheObjectAndItsOutlineFromNewViewpoints) {
  for (const Order order : {Order::list, Order::peel}) {
    OpacityMapRenderer renderer(*folder_ / "maps", {.samples = 2, .order = order});
    for (const Vec3<double>& direction : {Vec3<double>(1, 2, 3), Vec3<double>(-3, 0.5, 1)}) {
      const method::FrameLayers layers = renderer.render(sceneFrom(direction, *rest_));
      const auto camera = studio::cameraFrom<AcquisitionSpace>(direction, 48);
      const image::Image truth = studio::overBlack(studio::viewSphere(camera, 3), studio::fixedRadiance);
      double squares = 0;
      for (size_t i = 0; i < truth.values.size(); ++i)
        squares += std::pow(static_cast<double>(truth.values[i] - layers.color.values[i]), 2);
      const double rms = std::sqrt(squares / static_cast<double>(truth.values.size()));
      RecordProperty("rms", std::to_string(rms));
      EXPECT_LE(rms, 0.06);
    }
  }
}

TEST_F(OpacityMapRendererTest, DescribesItselfAndTakesItsKnobs) {
  OpacityMapRenderer renderer(*folder_ / "maps", {.samples = 2, .order = {}});
  EXPECT_EQ(renderer.describe().counts.at("terms"), 3u);
  EXPECT_LE(renderer.describe().counts.at("triangles"), 1000u);
  ASSERT_EQ(renderer.knobs().size(), 3u);
  EXPECT_EQ(renderer.knobs()[2].name, "layers");
  std::set<std::string> identities{renderer.describe().identity};
  for (const method::Setting& setting :
       {method::Setting{{"samples", 1}}, {{"terms", 1}}, {{"layers", 1}}, {{"terms", 1}, {"layers", 2}}}) {
    renderer.turn(setting);
    EXPECT_TRUE(identities.insert(renderer.describe().identity).second);
  }
  EXPECT_EQ(image::errorOf([&] {
              renderer.turn({{"layers", 0}});
            }),
            "knob.layers: found 0, expected a whole number of 1 to 64");
  EXPECT_THROW(renderer.turn({{"terms", 4}}), Error);
  OpacityMapRenderer lists(*folder_ / "maps", {.samples = 1, .order = Order::list});
  EXPECT_EQ(lists.knobs().size(), 2u);
  EXPECT_THROW(lists.turn({{"layers", 1}}), Error);
}

TEST_F(OpacityMapRendererTest, ASettingThatIsRefusedChangesNothing) {
  OpacityMapRenderer renderer(*folder_ / "maps");
  const scene::Scene scene = sceneFrom({1, 0, 0}, *rest_);
  const image::Image full = renderer.render(scene).color;
  const std::string identity = renderer.describe().identity;
  for (const method::Setting& setting :
       {method::Setting{{"samples", 2}, {"terms", 4}}, {{"terms", 0}, {"layers", 0}}}) {
    EXPECT_THROW(renderer.turn(setting), Error);
    EXPECT_EQ(renderer.describe().identity, identity);
    EXPECT_EQ(renderer.render(scene).color.values, full.values);
  }
}

TEST_F(OpacityMapRendererTest, ReportsWhatAFrameTook) {
  OpacityMapRenderer renderer(*folder_ / "maps");
  const method::FrameReport report = renderer.render(sceneFrom({1, 0, 0}, *rest_)).report;
  EXPECT_GE(report.counts.at("layers"), 1);
  EXPECT_EQ(report.counts.at("passes"), 2 * report.counts.at("layers") + 1);
  EXPECT_GT(report.counts.at("fragments"), 0);
  EXPECT_GT(report.seconds.at("draw"), 0);
  EXPECT_FALSE(report.remark.has_value());
}

TEST_F(OpacityMapRendererTest, RefusesLightsAndOtherFormats) {
  OpacityMapRenderer renderer(*folder_ / "maps");
  scene::Scene scene = sceneFrom({0, 0, 1}, *rest_);
  scene.lights.push_back(scene::ShotDirectionalLight{{0, 0, 1}, {1, 1, 1}});
  EXPECT_THROW(renderer.render(scene), Error);
  EXPECT_THROW(OpacityMapRenderer(*folder_ / "capture"), Error);
  EXPECT_THROW(OpacityMapRenderer(*folder_ / "maps", {.samples = 9, .order = {}}), Error);
}

} // namespace
} // namespace surflect::olf
