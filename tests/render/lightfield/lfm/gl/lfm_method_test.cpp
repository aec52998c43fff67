#include "render/lightfield/lfm/lfm_method.h"

#include "render/gl/context.h"
#include "render/lightfield/lfm/lfm_file.h"
#include "render/lightfield/lfm/lfm_frame.h"
#include "tests/render/lightfield/lfm/synthetic_maps.h"
#include "tests/support/synthetic_capture.h"

#include <memory>
#include <string>

namespace surflect::lfm {
namespace {

using namespace lfm::testing;

constexpr int kSize = 48;

// Maps of random numbers on a sphere, written once.
class LfmMethodTest : public ::testing::Test {
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

  static std::unique_ptr<method::Renderer> opened(const method::Setting& setting = {}) {
    return lfmMethod().open(*folder_ / "maps", setting, {});
  }

  static inline std::unique_ptr<image::TemporaryFolder> folder_;
  const warp::WarpPointer rest_ = warp::chainWarp({});
};

TEST_F(LfmMethodTest, ShowsTheFramesOfItsMaps) {
  const auto renderer = opened({{"samples", 1}}), first = opened({{"samples", 1}, {"terms", 1}});
  const LightFieldMaps maps = openMaps(*folder_ / "maps").maps;
  FrameRenderer frames(maps, gl::contextOfThread()->describe().limits);
  const auto camera = studio::cameraFrom<AcquisitionSpace>({1, 2, 3}, kSize);
  const scene::Scene scene = sceneFrom({1, 2, 3}, *rest_);
  EXPECT_EQ(renderer->render(scene).color.values, frames.render(camera).color.values);
  EXPECT_EQ(first->render(scene).color.values, frames.render(camera, {.terms = 1}).color.values);
}

TEST_F(LfmMethodTest, DescribesItself) {
  const auto renderer = opened();
  const method::Description& description = renderer->describe();
  EXPECT_EQ(description.rig.views.size(), 3u);
  EXPECT_EQ(description.counts.at("terms"), 3u);
  EXPECT_EQ(description.points.size(), openMaps(*folder_ / "maps").maps.mesh.positions.size());
  const std::string identity = description.identity;
  EXPECT_NE(identity, opened({{"samples", 1}})->describe().identity);
  EXPECT_NE(identity, opened({{"terms", 2}})->describe().identity);
  EXPECT_EQ(identity, opened({{"terms", 3}})->describe().identity);
}

TEST_F(LfmMethodTest, ReportsWhatAFrameTook) {
  const auto renderer = opened({{"passes", "per_term"}});
  const method::FrameReport report = renderer->render(sceneFrom({1, 0, 0}, *rest_)).report;
  EXPECT_EQ(report.counts.at("passes"), 4);
  EXPECT_EQ(report.counts.at("terms"), 3);
  EXPECT_GT(report.counts.at("texture_bytes"), 0);
  EXPECT_GT(report.seconds.at("draw"), 0);
  EXPECT_FALSE(report.remark.has_value());
}

TEST_F(LfmMethodTest, TermsAreAnOptionUpToThoseOfTheMaps) {
  const auto renderer = opened();
  const method::Option& terms = method::rowOf(method::optionsOf(*renderer), "terms");
  EXPECT_EQ(terms.sweep, (std::vector<method::Value>{3, 2, 1, 0}));
  EXPECT_THROW(renderer->set({{"terms", 4}}), Error);
  EXPECT_EQ(image::errorOf([&] {
              renderer->set({{"white", 2}});
            }),
            "--white: has an effect only with --passes clamped, found single");
}

} // namespace
} // namespace surflect::lfm
