#include "render/lightfield/common/photographs.h"

#include "render/lightfield/lfm/build.h"
#include "render/lightfield/lfm/lfm_file.h"
#include "render/lightfield/lumigraph/build.h"
#include "render/lightfield/slf/build.h"
#include "render/methods.h"
#include "tests/support/box_capture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <vector>

namespace surflect::lightfield {
namespace {

constexpr Rgb kColor{0.25f, 1, 2}; // exact in half floats
constexpr int kSize = 48;

// A cube of one colour. In the first of its photographs, a patch of the cube is not a number.
TEST(UnobservedPixels, LeaveNoDarkSpotInAnyLightField) {
  const image::TemporaryFolder folder;
  const std::vector<Vec3<double>> from = studio::spiral(32);
  const Vec3<double> patch(from[0].cwiseSign() * 0.5); // the corner that is nearest to the camera
  size_t invalid = 0;
  const auto radiance = [&](const Vec3<double>& place, const Vec3<double>& towards) {
    if (towards.dot(from[0]) < 0.98 || (place - patch).norm() > 0.12) return kColor;
    const float none =
        ++invalid % 2 ? std::numeric_limits<float>::quiet_NaN() : std::numeric_limits<float>::infinity();
    return Rgb{none, 1, 2};
  };
  boxes::writeCapture(boxes::unitCube(), radiance, {from, kSize, 0.25}, folder / "views");
  ASSERT_GE(invalid, 2u);
  const Views views(folder / "views");
  slf::buildWithCharts(views, boxes::faceCharts(views.mesh(), 24),
                       {.directions = 18, .tolerance = 0, .blend = slf::Blend::nearest}, folder / "slf");
  lumigraph::build(views, {.slabs = {.nodes = 3, .texels = 60000}, .resampling = {.nearest = true}},
                   folder / "lumigraph");
  lfm::BuildReport report;
  lfm::writeMaps(lfm::build(views, {.samples = 9, .viewSize = 8}, report), views.capture(), folder / "lfm");

  const auto rest = warp::chainWarp({});
  const scene::Scene scene{*rest, studio::cameraFrom<ObjectSpace>(from[0], kSize), {}};
  for (const char* tag : {"slf", "lumigraph", "lfm"}) {
    const image::Image color = method::openRenderer(folder / tag, {{"samples", 1}})->render(scene).color;
    size_t covered = 0;
    for (size_t i = 0; i < color.values.size(); i += 4) {
      if (color.values[i + 3] != 1) continue;
      ++covered;
      EXPECT_NEAR(color.values[i], kColor.r, 0.02f) << tag;
      EXPECT_NEAR(color.values[i + 1], kColor.g, 0.02f) << tag;
      EXPECT_NEAR(color.values[i + 2], kColor.b, 0.02f) << tag;
    }
    EXPECT_GT(covered, 300u) << tag;
  }
}

} // namespace
} // namespace surflect::lightfield
