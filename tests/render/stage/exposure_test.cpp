#include "render/stage/exposure.h"
#include "render/stage/stage_pictures.h"
#include "srf/calibration/response.h"
#include "srf/capture/photograph.h"
#include "surfel/base/file.h"
#include "tests/render/stage/stages.h"
#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

namespace surflect::stage {
namespace {

// Two balls, one much darker, at 48 x 48.
std::string stageText(const std::string& exposure) {
  return R"toml(
samples = 16
transport = "local"
[camera]
model = "orthographic"
size = [48, 48]
distance = 5
height = 2.2
[views]
directions = [[1, 0, 0], [0, 1, 0.5]]
[lights]
directions = [[1, 0, 0.3], [0.3, 1, 1]]
irradiance = [6, 5, 4]
)toml" + exposure +
         R"toml(
[[material]]
name = "chalk"
type = "lambert"
albedo = [0.9, 0.8, 0.7]
[[material]]
name = "coal"
type = "lambert"
albedo = [0.04, 0.04, 0.05]
[[object]]
type = "sphere"
material = "chalk"
center = [0, 0, 0.5]
radius = 0.5
[[object]]
type = "sphere"
material = "coal"
center = [0, 0, -0.5]
radius = 0.5
)toml";
}

const std::string kTimes = "[exposure]\ntimes = [0.1, 0.5, 2.5, 12.5]\n";
const std::string kNoise = "full_well = 20000\nread_noise = 10\n";

Stage stageWith(const std::string& exposure) { return parseStage(stageText(exposure), "stage.toml"); }

TEST(StageExposure, TheCodeIsTheNearest) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-0.1f, 1.2f);
  for (const char* response : {"srgb", "gamma"}) {
    const Stage stage = stageWith(kTimes + "response = \"" + response + "\"\n");
    const auto& curve = stage.exposure->response.exposure[0];
    for (int trial = 0; trial < 2000; ++trial) {
      const float x = uniform(random);
      const auto nearest =
          std::ranges::min_element(curve, {}, [x](float exposure) { return std::abs(exposure - x); });
      EXPECT_EQ(codeOf(stage.exposure->response, x), nearest - curve.begin()) << x;
    }
    for (size_t code = 0; code < 256; ++code) EXPECT_EQ(codeOf(stage.exposure->response, curve[code]), code);
    EXPECT_EQ(codeOf(stage.exposure->response, NAN), 0);
  }
}

// Mean x, variance (N + read^2) (x1 / well)^2, each within 5 standard deviations of its estimate.
TEST(StageExposure, NoiseIsThatOfTheElectronsAndOfReading) {
  StageExposure camera = *stageWith(kTimes + kNoise).exposure;
  for (const double x : {0.0, 0.01, 0.3, 2.0}) {
    const int n = 20000;
    Random random{7, static_cast<uint64_t>(1000 * x)};
    double sum = 0, squares = 0;
    for (int i = 0; i < n; ++i) {
      const double difference = sensed(x, camera, random) - x;
      sum += difference;
      squares += difference * difference;
    }
    const double variance = (20000 * x + 100) / (20000. * 20000);
    EXPECT_NEAR(sum / n, 0, 5 * std::sqrt(variance / n)) << x;
    EXPECT_NEAR(squares / n, variance, 5 * variance * std::sqrt(2. / n)) << x;
  }
  camera.fullWell = 0;
  Random random{7};
  EXPECT_EQ(sensed(0.3, camera, random), 0.3);
}

// Error of a code in exposure: half a step to either side.
double halfStep(const image::Response& response, int code) {
  const auto& curve = response.exposure[0];
  const double below = curve[static_cast<size_t>(code)] - curve[static_cast<size_t>(std::max(code - 1, 0))];
  const double above = curve[static_cast<size_t>(std::min(code + 1, 255))] - curve[static_cast<size_t>(code)];
  return std::max(below, above) / 2;
}

// Error bound of a merged pixel: every exposure with weight is off by its noise and half a step at most.
double mergedBound(double radiance, const StageExposure& camera) {
  double bound = 0;
  for (const double seconds : camera.seconds) {
    const double x = seconds * radiance;
    const double sigma =
        camera.fullWell > 0
            ? std::sqrt(camera.fullWell * x + camera.readNoise * camera.readNoise) / camera.fullWell
            : 0;
    const int low = codeOf(camera.response, static_cast<float>(x - 6 * sigma)),
              high = codeOf(camera.response, static_cast<float>(x + 6 * sigma));
    if (high == 0 || low == 255) continue; // no weight
    bound = std::max(bound,
                     (6 * sigma + std::max(halfStep(camera.response, low), halfStep(camera.response, high))) /
                         seconds);
  }
  return bound;
}

TEST(StageExposure, MergingGivesTheRadianceBackWithinTheNoise) {
  const image::TemporaryFolder folder;
  captureStage(stageWith(""), nullptr, StageFrames::all, folder / "exact", {});
  const capture::Capture exact = capture::readCapture(folder / "exact");
  int number = 0;
  for (const std::string& exposure : {kTimes, kTimes + kNoise, kTimes + "response = \"gamma\"\n" + kNoise}) {
    const std::string name = "c" + std::to_string(number++);
    const Stage stage = stageWith(exposure);
    captureStage(stage, nullptr, StageFrames::all, folder / name, {});
    const capture::Capture capture = capture::readCapture(folder / name);
    ASSERT_EQ(capture.frames.size(), exact.frames.size());
    size_t compared = 0, darkest = 0;
    for (size_t i = 0; i < capture.frames.size(); ++i) {
      ASSERT_EQ(capture.frames[i].further.size(), 3u);
      const capture::Photograph merged = capture::readPhotographs(capture, std::span(&i, 1))[0],
                                truth = capture::readPhotographs(exact, std::span(&i, 1))[0];
      for (size_t v = 0; v < truth.radiance.values.size(); ++v) {
        if (truth.alpha.values[v / 3] < 1) continue;
        const double radiance = truth.radiance.values[v];
        const double bound = mergedBound(radiance, *stage.exposure);
        if (bound == 0) continue; // black in all
        EXPECT_NEAR(merged.radiance.values[v], radiance, bound + 1e-3 * radiance) << name << ' ' << v;
        ++compared;
        darkest += radiance < 0.01;
      }
    }
    EXPECT_GT(compared, 5000u);
    EXPECT_GT(darkest, 200u);
  }
}

// But for its scale, from exposures a stop apart; darker codes have little weight. Recovery is told none of
// it.
TEST(StageExposure, TheResponseIsRecovered) {
  for (const char* response : {"srgb", "gamma"}) {
    const image::TemporaryFolder folder;
    const Stage stage = stageWith("[exposure]\ntimes = [0.2, 0.4, 0.8, 1.6]\nresponse = \"" +
                                  std::string(response) + "\"\n" + kNoise);
    captureStage(stage, nullptr, StageFrames::all, folder / "c", {});
    const image::Response recovered = calibration::recoverResponse(capture::readCapture(folder / "c"), {});
    const auto& truth = stage.exposure->response.exposure[0];
    for (size_t channel = 0; channel < 3; ++channel) {
      const auto& curve = recovered.exposure[channel];
      for (size_t code = 32; code < 256; ++code)
        EXPECT_NEAR(curve[code] / curve[128] / (truth[code] / truth[128]), 1, 0.05)
            << response << ' ' << channel << ' ' << code;
    }
  }
}

TEST(StageExposure, ItsCaptureGoesOnWhereItStopped) {
  const image::TemporaryFolder folder;
  const Stage stage = stageWith(kTimes + kNoise);
  captureStage(stage, nullptr, StageFrames::all, folder / "c", {});
  const std::string picture = readFile(folder / "c/images/C001.L00.2.png");
  std::filesystem::remove(folder / "c/images/C001.L00.2.png");
  EXPECT_EQ(captureStage(stage, nullptr, StageFrames::all, folder / "c", {}).resumedViews, 1u);
  EXPECT_EQ(readFile(folder / "c/images/C001.L00.2.png"), picture);
}

TEST(StageExposure, WhatIsWrongIsSaid) {
  const image::TemporaryFolder folder;
  const auto error = [](const std::string& exposure) { return image::errorOf([&] { stageWith(exposure); }); };
  const auto expect = [&](const std::string& exposure, const std::string& part) {
    EXPECT_NE(error(exposure).find(part), std::string::npos) << error(exposure);
  };
  expect("[exposure]\ntimes = []\n", "exposure.times");
  expect("[exposure]\n", "exposure.times");
  expect("[exposure]\ntimes = [1, 0]\n", "exposure.times[1]");
  expect("[exposure]\ntimes = [1, nan]\n", "exposure.times[1]");
  expect("[exposure]\ntimes = [1, 2, 1]\n", "exposure.times[2]");
  expect(kTimes + "read_noise = 3\n", "exposure.read_noise");
  expect(kTimes + "full_well = 0\n", "exposure.full_well");
  expect(kTimes + "gain = 2\n", "exposure.gain");
  const auto file = [&](const std::string& content) {
    image::writeBytes(folder / "curve.txt", content);
    return kTimes + "response = \"" + (folder / "curve.txt").string() + "\"\n";
  };
  expect(kTimes + "response = \"" + (folder / "none.txt").string() + "\"\n", "none.txt");
  std::string rising;
  for (int i = 0; i < 256; ++i) rising += std::to_string(i * i) + "\n";
  EXPECT_EQ(stageWith(file(rising)).exposure->response.exposure[1][16], 256);
  EXPECT_NE(stageWith(file(rising)).hash, stageWith(file("0 " + rising.substr(2))).hash);
  expect(file(rising + "65026"), "256 numbers");
  expect(file("1 2 3"), "256 numbers");
  expect(file("1 2 nought"), "256 numbers");
  expect(file("5 4"), "number 1");
  expect(file("-1 4"), "number 0");
  std::string black;
  for (int i = 0; i < 256; ++i) black += "0 ";
  expect(file(black), "above 0");
}

} // namespace
} // namespace surflect::stage
