#include "render/splat/splat_raster.h"

#include "render/evaluation/measure.h"
#include "tests/render/scene.h"
#include "tests/support/each_simd.h"

#include <gtest/gtest.h>

#include <limits>

namespace surflect::splat {
namespace {

using namespace testing;

TEST(Blend, ALinearRampOnAWarpedSheetIsReproduced) {
  Rng rng(1);
  const SurfelCloud rest = sheet(1, 1, 0.02, 0.1, rng);
  const auto warp = [](const V3& p) { // sheared, stretched 1:3, curved
    const double x = 0.6 * p[0] + 0.3 * p[1];
    return V3(x, 1.8 * p[1], 0.3 * x * x + p[2]);
  };
  Scene scene;
  // Colour is linear on the screen: a function of x / depth.
  const V3 eye(0, 0, 4);
  scene.add(rest, warp, [&](const V3& p) { return V3(0.5 + 2 * p[0] / (4 - p[2]), 0, 0); });
  for (const double focal : {60., 200., 600., 2400., 9000.}) { // surfels 0.2 to 60 pixels apart
    const int size = 192;
    const auto camera = lookAt(eye, {0, 0, 0}, size, size, focal);
    const SplatRaster coverage = rasterize(camera, scene.splats());
    const image::Image image = blend(coverage, ofVisible(coverage, scene.colors), 3);
    double sum = 0, low = 1e9, high = 0, worst = 0;
    size_t pixels = 0;
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < size; ++x) {
        const double px = (x + 0.5 - size / 2.0) / focal, py = (y + 0.5 - size / 2.0) / focal;
        if (std::hypot(px, py) > 0.08) continue; // leaves out the sheet's edges
        const double area = coverage.layerArea[coverage.pixel(x, y)];
        EXPECT_EQ(coverage.alpha[coverage.pixel(x, y)], 1);
        worst = std::max(worst, std::abs(image.at(x, y)[0] - (0.5 + 2 * px)));
        sum += area, low = std::min(low, area), high = std::max(high, area), ++pixels;
      }
    const double mean = sum / static_cast<double>(pixels);
    EXPECT_NEAR(mean, 1, 0.025) << focal;
    EXPECT_GT(low, 0.9 * mean) << focal;
    EXPECT_LT(high, 1.1 * mean) << focal;
    EXPECT_LT(worst, 0.9 / 900) << focal; // less than a third of 1/255: the ramp spans 0.9 over the sheet
  }
}

TEST(Blend, ACheckerboardToTheHorizonIsAntialiased) {
  // A log-polar grid around the viewer's foot: surfels grow with distance, so that their size on the screen
  // is constant.
  Rng rng(2);
  const double near = std::log(0.7), far = std::log(300.0), halfAngle = 1.0;
  const auto fromLogPolar = [&](const V3& p) {
    const double r = std::exp(p[0] + (near + far) / 2);
    return V3(r * std::sin(p[1]), r * p[2], -r * std::cos(p[1]));
  };
  const SurfelCloud rest = sheet((far - near) / 2, halfAngle, 0.008, 0.1, rng);
  const auto white = [](double x, double z) {
    return (static_cast<long>(std::floor(x) + std::floor(z)) & 1) == 0;
  };
  Scene scene;
  scene.add(rest, fromLogPolar,
            [&](const V3& p) { return white(p[0], p[2]) ? V3(0.8, 0, 0) : V3(0.2, 0, 0); });

  const int width = 160, height = 120;
  const double focal = 110;
  const capture::Camera<ObjectSpace> camera = lookAt({0, 1, 0}, {0, 0.6, -1}, width, height, focal);
  const image::Image image = rendered(scene, camera);
  double squared = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      constexpr int n = 16;
      double sum = 0;
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const auto ray = capture::rayThrough(camera.lens, {x + (i + 0.5) / n, y + (j + 0.5) / n});
          const V3 d = camera.cameraFromWorld.inverse()(ray->direction).raw();
          const double t = -1 / d[1];
          if (d[1] < 0 && std::hypot(t * d[0], t * d[2]) < 300) sum += white(t * d[0], t * d[2]) ? 0.8 : 0.2;
        }
      const double difference = image.at(x, y)[0] - sum / (n * n);
      squared += difference * difference;
    }
  EXPECT_GT(evaluation::psnr(squared / (width * height)), 30);
}

TEST(Blend, RowsSumToAlphaWhateverTheConfidence) {
  Rng rng(21);
  const Scene scene = sphereBeforePlane(rng);
  const SplatRaster coverage = rasterize(lookAt({1, 1.5, 5}, {0, 0, 0}, 160, 120, 150), scene.splats());
  const std::vector<float> ones(coverage.visible.size(), 1);
  std::vector<float> confidence;
  for (size_t i = 0; i < ones.size(); ++i) confidence.push_back(static_cast<float>(uniform(rng, 1e-6, 1)));
  const image::Image sums = blend(coverage, ones, 1, confidence);
  for (size_t pixel = 0; pixel < sums.values.size(); ++pixel)
    EXPECT_NEAR(sums.values[pixel], coverage.alpha[pixel], 1e-6);
}

TEST(Blend, ConfidenceThatIsTheSameForAllChangesNothing) {
  Rng rng(22);
  const Scene scene = sphereBeforePlane(rng);
  const SplatRaster coverage = rasterize(lookAt({1, 1.5, 5}, {0, 0, 0}, 160, 120, 150), scene.splats());
  const auto colors = ofVisible(coverage, scene.colors);
  const std::vector<float> alike(coverage.visible.size(), 0.03f);
  const image::Image plain = blend(coverage, colors, 3), weighted = blend(coverage, colors, 3, alike);
  for (size_t i = 0; i < plain.values.size(); ++i) EXPECT_NEAR(weighted.values[i], plain.values[i], 1e-6);
}

// Two coincident sheets, and a third behind them: within a layer, the sheet of higher confidence determines
// the colour; the sheet behind stays hidden at any confidence.
TEST(Blend, ConfidenceActsWithinALayer) {
  Rng rng(23);
  Scene scene;
  const SurfelCloud trusted = sheet(1, 1, 0.03, 0.1, rng), doubted = sheet(1, 1, 0.03, 0.1, rng);
  scene.add(trusted, unmoved, constant(red));
  scene.add(doubted, unmoved, constant(green));
  scene.add(
      sheet(2, 2, 0.03, 0.1, rng), [](const V3& p) { return V3(p - V3(0, 0, 0.5)); }, constant(V3(0, 0, 1)));
  const SplatRaster coverage = rasterize(lookAt({0, 0, 4}, {0, 0, 0}, 96, 96, 200), scene.splats());
  std::vector<float> confidence;
  for (const uint32_t splat : coverage.visible) {
    const bool isDoubted = splat >= trusted.size() && splat < trusted.size() + doubted.size();
    confidence.push_back(isDoubted ? 1e-4f : 1);
  }
  const auto colors = ofVisible(coverage, scene.colors);
  const image::Image plain = blend(coverage, colors, 3), image = blend(coverage, colors, 3, confidence);
  EXPECT_NEAR(plain.at(48, 48)[1], 0.5, 0.2);
  for (int y = 32; y < 64; ++y)
    for (int x = 32; x < 64; ++x) {
      EXPECT_GT(image.at(x, y)[0], 0.99);
      EXPECT_EQ(image.at(x, y)[2], 0);
    }
}

TEST(Blend, WhatIsInfiniteStaysWhereItIsSeen) {
  Rng rng(17);
  const Scene scene = sphereBeforePlane(rng);
  for (const Simd simd : EachSimd()) {
    const splat::SplatRaster coverage =
        splat::rasterize(lookAt({2, 1, 5}, {0, 0, 0}, 70, 50, 60), scene.splats());
    std::vector<float> values(coverage.visible.size(), 0);
    for (size_t i = 0; i < values.size(); i += 50) {
      values[i] = 1;
      const image::Image seen = blend(coverage, values, 1);
      values[i] = std::numeric_limits<float>::infinity();
      const image::Image image = blend(coverage, values, 1);
      values[i] = 0;
      for (size_t p = 0; p < image.values.size(); ++p)
        ASSERT_EQ(std::isfinite(image.values[p]), seen.values[p] == 0) << nameOf(simd) << ", pixel " << p;
    }
  }
}

} // namespace
} // namespace surflect::splat
