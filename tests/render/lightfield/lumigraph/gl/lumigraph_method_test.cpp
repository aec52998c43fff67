#include "render/lightfield/lumigraph/lumigraph_method.h"

#include "render/lightfield/common/views.h"
#include "render/lightfield/lumigraph/build.h"
#include "tests/support/synthetic_capture.h"

#include <cmath>
#include <memory>

namespace surflect::lumigraph {
namespace {

// A matte sphere, built once.
class LumigraphMethodTest : public ::testing::Test {
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

TEST_F(LumigraphMethodTest, ShowsTheObjectFromNewViewpoints) {
  const auto renderer = lumigraphMethod().open(*folder_ / "lumigraph", {{"samples", 1}}, {});
  for (const Vec3<double>& direction :
       {Vec3<double>(1, 2, 3), Vec3<double>(-3, 0.5, 1), Vec3<double>(0, -1, 0.1)}) {
    const method::FrameLayers layers = renderer->render(sceneFrom(direction, *rest_));
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

TEST_F(LumigraphMethodTest, DescribesItself) {
  const auto renderer = lumigraphMethod().open(*folder_ / "lumigraph", {}, {});
  const method::Description& description = renderer->describe();
  EXPECT_EQ(description.rig.views.size(), 30u);
  EXPECT_EQ(description.counts.at("nodes"), 3u);
  EXPECT_LE(description.counts.at("texels"), 100000u);
  EXPECT_FALSE(description.points.empty());
  EXPECT_LE(length(description.middle - Point(0, 0, 0)), 1e-3);
}

} // namespace
} // namespace surflect::lumigraph
