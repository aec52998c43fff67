#include "render/splat/reference.h"

#include "bench/doll/doll_model.h"
#include "bench/doll/doll_shot.h"
#include "render/evaluation/measure.h"
#include "render/splat/splat_raster.h"
#include "tests/render/scene.h"
#include "tests/support/each_simd.h"
#include "warp/deform.h"

#include <gtest/gtest.h>

#include <random>

namespace surflect::splat {
namespace {

using namespace testing;

// Compares a raster with the reference. Scenes: the doll has limbs before its body, and creases; the sphere
// grazes a plane; the sheet is a stack of two.
void expectTheSame(const capture::Camera<ObjectSpace>& camera, const Splats& splats,
                   const std::vector<float>& colors, double leastDb = 110, const SplatOptions& options = {},
                   double mostFlipped = 2e-5) {
  const ReferenceRaster expected = referenceRaster(camera, splats, options);
  std::mt19937 random(1);
  std::vector<float> confidence; // 1e-4 to 1
  for (size_t i = 0; i < splats.size(); ++i)
    confidence.push_back(std::pow(10.f, -4 * static_cast<float>(random() % 1000) / 1000));
  const image::Image expectedImage = blend(expected, colors, 3, confidence);
  for (const Simd simd : EachSimd()) {
    const SplatRaster got = rasterize(camera, splats, options);
    std::vector<float> ofSeen;
    for (const uint32_t splat : got.visible) ofSeen.push_back(confidence[splat]);
    const image::Image image = blend(got, ofVisible(got, colors), 3, ofSeen), depth = depthImage(got);
    const auto near = [](size_t a, size_t b) { return std::max(a, b) - std::min(a, b) <= 1 + a / 2000; };
    EXPECT_TRUE(near(got.counts.drawn, expected.drawn));
    EXPECT_TRUE(near(got.counts.backFacing, expected.backFacing));
    EXPECT_TRUE(near(got.visible.size(), visibleSplats(expected).size()));
    // Rounding may place a fragment at the end of a layer on its other side.
    size_t flipped = 0;
    double squared = 0;
    for (size_t i = 0; i < got.alpha.size(); ++i) {
      double worst = std::abs(got.alpha[i] - expected.alpha[i]);
      for (size_t k = 0; k < 3; ++k) {
        const double difference = image.values[3 * i + k] - expectedImage.values[3 * i + k];
        worst = std::max(worst, std::abs(difference));
        squared += difference * difference;
      }
      flipped += worst > 1e-4;
      if (worst <= 1e-4 && std::isfinite(expected.depth[i])) {
        EXPECT_NEAR(depth.values[i] / expected.depth[i], 1, 1e-4);
      }
    }
    EXPECT_LE(flipped, std::floor(mostFlipped * static_cast<double>(got.alpha.size()))) << nameOf(simd);
    EXPECT_GT(evaluation::psnr(squared / static_cast<double>(3 * got.alpha.size())), leastDb) << nameOf(simd);
  }
}

TEST(SplatReference, TheFastSplatterDrawsTheSame) {
  const SurfelCloud doll = bench::dollCloud(20'000);
  const DeformedCloud deformed = warp::deform(doll, *warp::chainWarp({}));
  for (const int height : {90, 300})
    expectTheSame(bench::frontCamera(doll, height * 4 / 3 + 1, height + 1), splatsOf(doll, deformed),
                  bench::dollColors(doll));
  Rng rng(17);
  const Scene scene = sphereBeforePlane(rng);
  auto camera = lookAt({1, 1.5, 5}, {0, 0, 0}, 160, 120, 150);
  expectTheSame(camera, scene.splats(), scene.colors);
  camera.lens.k1 = -0.1;
  expectTheSame(camera, scene.splats(), scene.colors);
  camera.lens.model = capture::Lens::Model::orthographic;
  camera.lens.focalX = camera.lens.focalY = 40;
  expectTheSame(camera, scene.splats(), scene.colors);
  expectTheSame(lookAt({0, 0, 1.2}, {0.3, 0.2, 0}, 160, 120, 900), scene.splats(),
                scene.colors); // large splats
}

// A growth ends at a fragment that begins just behind the layer, in every pixel that is not searched;
// rounding therefore moves more fragments to the other side.
TEST(SplatReference, TheFastSplatterDrawsTheSameWithoutSearchForLayers) {
  const SurfelCloud doll = bench::dollCloud(20'000);
  const DeformedCloud deformed = warp::deform(doll, *warp::chainWarp({}));
  expectTheSame(bench::frontCamera(doll, 160, 120), splatsOf(doll, deformed), bench::dollColors(doll), 70,
                {.searchLayers = false}, 2e-4);
}

// Coincident copies share their depth; 300 of them exceed the number of fragments in a pixel that are
// compared pairwise.
TEST(SplatReference, TheFastSplatterDrawsTheSameOfCopies) {
  for (const int copies : {2, 300}) {
    Rng rng(19);
    Scene scene;
    SurfelCloud sphere = unitSphere(100, rng), plane = sheet(2, 2, 0.3, 0.1, rng);
    for (SurfelCloud* cloud : {&sphere, &plane})
      for (float& coverage : cloud->coverage) coverage /= static_cast<float>(copies);
    const auto color = [](const V3& p) { return V3(0.5 + 0.4 * p[0], 0.5 + 0.2 * p[1], 0.3); };
    for (int i = 0; i < copies; ++i) {
      scene.add(sphere, unmoved, color);
      scene.add(
          plane, [](const V3& p) { return V3(p + V3(0, 0, -1.5)); }, color);
    }
    // Sums of thousands of floats err by 1e-5 (104.6 dB), and no pixel is an outlier.
    expectTheSame(lookAt({1, 1.5, 5}, {0, 0, 0}, 48, 36, 40), scene.splats(), scene.colors,
                  copies == 2 ? 110 : 100);
  }
}

TEST(SplatReference, TheOrderOfTheCloudChangesNothing) {
  const SurfelCloud doll = bench::dollCloud(20'000);
  const auto camera = bench::frontCamera(doll, 320, 240);
  const auto draw = [&](const SurfelCloud& cloud) {
    const DeformedCloud deformed = warp::deform(cloud, *warp::chainWarp({}));
    const SplatRaster coverage = rasterize(camera, splatsOf(cloud, deformed));
    return blendWithAlpha(coverage, ofVisible(coverage, bench::dollColors(cloud)), 3);
  };
  const image::Image a = draw(doll), b = draw(bench::shuffled(doll));
  for (size_t i = 0; i < a.values.size(); ++i) ASSERT_NEAR(a.values[i], b.values[i], 1e-6);
}

} // namespace
} // namespace surflect::splat
