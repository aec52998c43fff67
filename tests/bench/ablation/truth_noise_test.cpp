#include "bench/ablation/truth_noise.h"

#include "render/stage/stage_capture.h"
#include "surfel/base/error.h"
#include "tests/srf/image/files.h"

#include <fmt/format.h>

namespace surflect::bench {
namespace {

// A ball in a bowl of light: wide lamps, so that paths are noisy.
constexpr const char* kStage = R"(
samples = {}
seed = {}
[camera]
model = "orthographic"
size = [24, 24]
distance = 5
height = 2.4
[views]
count = 2
test = 1
[lights]
count = 2
irradiance = [3, 3, 3]
radius_deg = 60
[[material]]
name = "clay"
type = "lambert"
albedo = [0.8, 0.4, 0.2]
[[object]]
type = "bumpy_sphere"
material = "clay"
radius = 1
amplitude = 0.2
frequency = 4
segments = 32
)";

TEST(TruthNoise, FallsWithTheSamplesAndIsNoneWithoutSeeds) {
  const image::TemporaryFolder folder;
  const auto captured = [&](int samples, int seed) {
    const auto path = folder / fmt::format("{}-{}", samples, seed);
    stage::captureStage(stage::parseStage(fmt::format(fmt::runtime(kStage), samples, seed), "stage.toml"),
                        nullptr, stage::StageFrames::all, path, {});
    return capture::readCapture(path);
  };
  const capture::Capture coarse = captured(4, 1), fine = captured(64, 1);
  EXPECT_EQ(differenceOf(coarse, coarse, {}).squaredErrorLinear.mean(), 0);
  EXPECT_NEAR(differenceOf(coarse, coarse, {}).ssim(), 1, 1e-6);
  const evaluation::Difference ofCoarse = differenceOf(coarse, captured(4, 2), {}),
                               ofFine = differenceOf(fine, captured(64, 2), {});
  EXPECT_GT(ofFine.squaredErrorLinear.mean(), 0);
  EXPECT_GT(ofCoarse.squaredErrorLinear.mean(), 10 * ofFine.squaredErrorLinear.mean());
  EXPECT_LT(ofCoarse.ssim(), ofFine.ssim());
}

TEST(TruthNoise, NeedsTheSameFrames) {
  capture::Capture one, other;
  one.frames.emplace_back();
  EXPECT_THROW(differenceOf(one, other, {}), Error);
}

} // namespace
} // namespace surflect::bench
