#include "render/lightfield/olf/opacity_method.h"

#include "render/lightfield/common/views.h"
#include "render/lightfield/olf/opacity_map_build.h"
#include "render/lightfield/olf/opacity_maps.h"
#include "tests/srf/image/files.h"
#include "tests/support/synthetic_capture.h"

#include <cmath>
#include <memory>
#include <set>
#include <string>

namespace surflect::olf {
namespace {

// Maps of a matte sphere, built once.
class OpacityMapMethodTest : public ::testing::Test {
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

  static std::unique_ptr<method::Renderer> opened(const method::Setting& setting = {}) {
    return olfmMethod().open(*folder_ / "maps", setting, {});
  }

  static inline std::unique_ptr<image::TemporaryFolder> folder_;
  const warp::WarpPointer rest_ = warp::chainWarp({});
};

TEST_F(OpacityMapMethodTest, ShowsTheObjectAndItsOutlineFromNewViewpoints) {
  for (const char* order : {"list", "peel"}) {
    const auto renderer = opened({{"order", order}});
    for (const Vec3<double>& direction : {Vec3<double>(1, 2, 3), Vec3<double>(-3, 0.5, 1)}) {
      const method::FrameLayers layers = renderer->render(sceneFrom(direction, *rest_));
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

TEST_F(OpacityMapMethodTest, DescribesItselfAndTakesItsKnobs) {
  const auto renderer = opened({{"order", "peel"}});
  EXPECT_EQ(renderer->describe().counts.at("terms"), 3u);
  EXPECT_LE(renderer->describe().counts.at("triangles"), 1000u);
  std::set<std::string> identities{renderer->describe().identity};
  for (method::Setting setting :
       {method::Setting{{"samples", 1}}, {{"terms", 1}}, {{"layers", 1}}, {{"terms", 1}, {"layers", 2}}}) {
    setting["order"] = "peel";
    renderer->set(setting);
    EXPECT_TRUE(identities.insert(renderer->describe().identity).second);
  }
  EXPECT_EQ(image::errorOf([&] {
              renderer->set({{"order", "peel"}, {"layers", 0}});
            }),
            "--layers: found 0, expected 1..64, whole");
  EXPECT_EQ(image::errorOf([&] {
              renderer->set({{"layers", 1}});
            }),
            "--layers: has an effect only with --order peel, found list");
  EXPECT_THROW(renderer->set({{"terms", 4}}), Error);
}

TEST_F(OpacityMapMethodTest, LayersAreAKnobOfPeelingAlone) {
  const auto peeled = opened({{"order", "peel"}}), listed = opened();
  EXPECT_FALSE(method::rowOf(method::optionsOf(*peeled), "layers").sweep.empty());
  EXPECT_TRUE(method::rowOf(method::optionsOf(*listed), "layers").sweep.empty());
}

TEST_F(OpacityMapMethodTest, ReportsWhatAFrameTook) {
  const auto renderer = opened({{"order", "peel"}});
  const method::FrameReport report = renderer->render(sceneFrom({1, 0, 0}, *rest_)).report;
  EXPECT_GE(report.counts.at("layers"), 1);
  EXPECT_EQ(report.counts.at("passes"), 2 * report.counts.at("layers") + 1);
  EXPECT_GT(report.counts.at("fragments"), 0);
  EXPECT_GT(report.seconds.at("draw"), 0);
  EXPECT_FALSE(report.remark.has_value());
}

} // namespace
} // namespace surflect::olf
