#include "render/lightfield/spherical/spherical_method.h"

#include "render/lightfield/common/views.h"
#include "render/lightfield/spherical/build.h"
#include "render/lightfield/spherical/flight.h"
#include "surfel/base/error.h"
#include "tests/support/synthetic_capture.h"

#include <cmath>
#include <filesystem>
#include <memory>

namespace surflect::spherical {
namespace {

// A matte sphere, built once.
class SphericalMethodTest : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<image::TemporaryFolder>();
    studio::photograph({.cameras = 30, .lights = 0, .size = 48}, *folder_ / "capture");
    build(lightfield::Views(*folder_ / "capture"), {.levels = 3, .size = 64}, {}, *folder_ / "field");
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static scene::Scene sceneFrom(const Vec3<double>& direction, const warp::Warp& warp) {
    return {warp, studio::cameraFrom<ObjectSpace>(direction, 48), {}};
  }
  static std::unique_ptr<method::Renderer> opened(const method::Setting& setting = {}) {
    return sphericalMethod().open(*folder_ / "field", setting, {});
  }
  static size_t images(size_t count) { return count * imageBytes(64); }

  static inline std::unique_ptr<image::TemporaryFolder> folder_;
  const warp::WarpPointer rest_ = warp::chainWarp({});
};

TEST_F(SphericalMethodTest, ShowsTheObjectFromNewViewpoints) {
  const auto renderer = opened();
  for (const Vec3<double>& direction :
       {Vec3<double>(1, 2, 3), Vec3<double>(-3, 0.5, 1), Vec3<double>(0, -1, 0.1)}) {
    const method::FrameLayers layers = renderer->render(sceneFrom(direction, *rest_), {"depth"});
    const auto camera = studio::cameraFrom<AcquisitionSpace>(direction, 48);
    const image::Image truth = studio::overBlack(studio::viewSphere(camera, 1), studio::fixedRadiance);
    double squares = 0;
    size_t covered = 0;
    for (size_t i = 0; i < truth.values.size(); i += 4) {
      if (truth.values[i + 3] < 1 || layers.color.values[i + 3] < 0.99f) continue;
      ++covered;
      for (size_t channel = 0; channel < 3; ++channel)
        squares +=
            std::pow(static_cast<double>(truth.values[i + channel] - layers.color.values[i + channel]), 2);
    }
    EXPECT_GT(covered, 500u);
    EXPECT_LT(std::sqrt(squares / (3.0 * static_cast<double>(covered))), 0.02);
    EXPECT_NEAR(layers.aovs.at("depth").at(24, 24)[0], studio::cameraDistance - 1, 0.03);
  }
}

TEST_F(SphericalMethodTest, PixelsDependNeitherOnBudgetsNorOnWhatWasRenderedBefore) {
  constexpr size_t kTightMb = 2;
  ASSERT_LT(kTightMb << 20, images(50)); // of 420
  const auto large = opened(), small = opened({{"cache_mb", kTightMb}});
  const scene::Scene scene = sceneFrom({1, 2, 3}, *rest_);
  const image::Image first = large->render(scene).color;
  small->render(sceneFrom({-3, 1, 1}, *rest_));
  const method::FrameLayers batched = small->render(scene);
  EXPECT_GT(batched.report.counts.at("passes"), 1);
  EXPECT_EQ(batched.color.values, first.values);
  EXPECT_EQ(large->render(scene).color.values, first.values);
}

TEST_F(SphericalMethodTest, KnobsChangeThePixelsAndTheIdentity) {
  const auto renderer = opened();
  const scene::Scene scene = sceneFrom({1, 2, 3}, *rest_);
  const image::Image full = renderer->render(scene).color;
  const std::string identity = renderer->describe().identity;
  for (const method::Setting& setting :
       {method::Setting{{"level", 1}}, {{"level", 0.5}}, {{"depth", "off"}}, {{"interpolated", "off"}}}) {
    renderer->set(setting);
    EXPECT_NE(renderer->describe().identity, identity);
    EXPECT_NE(renderer->render(scene).color.values, full.values);
  }
  renderer->set({});
  EXPECT_EQ(renderer->describe().identity, identity);
  for (const method::Setting& setting :
       {method::Setting{{"level", 3}}, {{"level", -1}}, {{"depth", 0.5}}, {{"cache_mb", 1}}})
    EXPECT_THROW(renderer->set(setting), Error);
}

// Mean square of the differences between neighbouring pixels in a row.
double roughness(const image::Image& picture) {
  double sum = 0;
  for (size_t i = 4; i < picture.values.size(); ++i)
    sum += std::pow(double{picture.values[i]} - picture.values[i - 4], 2);
  return sum / static_cast<double>(picture.values.size());
}

TEST_F(SphericalMethodTest, CoarserMipLevelsAreSmoother) {
  const auto renderer = opened();
  const scene::Scene scene = sceneFrom({1, 2, 3}, *rest_);
  const image::Image full = renderer->render(scene).color;
  double before = roughness(full);
  renderer->set({{"mip", method::Value(0)}});
  EXPECT_EQ(renderer->render(scene).color.values, full.values);
  for (const int mip : {1, 2, 3}) {
    renderer->set({{"mip", method::Value(mip)}});
    const double now = roughness(renderer->render(scene).color);
    EXPECT_LT(now, before) << mip;
    before = now;
  }
}

TEST_F(SphericalMethodTest, BudgetsThatAreTooSmallAreRefused) {
  EXPECT_THROW(opened({{"cache_mb", 0}}), Error);
  EXPECT_THROW(OpenFlight(*folder_ / "field", {0, images(100)}, {}), Error);
  EXPECT_THROW(OpenFlight(*folder_ / "field", {images(100), images(20)}, {}), Error);
}

TEST_F(SphericalMethodTest, AFlightThatWaitsShowsWhatTheRendererShowsWithinAnyBudgets) {
  const auto renderer = opened();
  const image::Image expected = renderer->render(sceneFrom({1, 2, 3}, *rest_)).color;
  for (const CacheBudgets& budgets : {CacheBudgets{}, CacheBudgets{images(1), images(21)}}) {
    OpenFlight flight(*folder_ / "field", budgets, {.wait = true});
    const FrameRecord record =
        flight.frame(studio::cameraFrom<AcquisitionSpace>({1, 2, 3}, 48), {2, 0, true, true}, 2);
    EXPECT_EQ(flight.picture().color.values, expected.values);
    EXPECT_GT(record.counts.reads, 0u);
    EXPECT_EQ(record.counts.substituted, 0u);
    EXPECT_GT(record.seconds, 0);
  }
}

TEST_F(SphericalMethodTest, AFlightThatDoesNotWaitFillsInWhatArrives) {
  OpenFlight flight(*folder_ / "field", {}, {});
  const auto camera = studio::cameraFrom<AcquisitionSpace>({1, 2, 3}, 48);
  size_t missing = 1;
  for (int frame = 0; frame < 1000 && missing > 0; ++frame) {
    missing = flight.frame(camera, {2, 0, true, true}, 1).counts.substituted;
    EXPECT_GT(flight.picture().color.at(24, 24)[3], 0.99f); // never a hole
  }
  EXPECT_EQ(missing, 0u);
}

} // namespace
} // namespace surflect::spherical
