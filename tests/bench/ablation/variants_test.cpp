#include "bench/ablation/variants.h"

#include "bench/ablation/ray_cast.h"
#include "tests/support/synthetic_capture.h"

#include <gtest/gtest.h>

namespace surflect::bench {
namespace {

using studio::PackedStudio;

constexpr size_t cacheBytes = size_t{1} << 28;

capture::Camera<ObjectSpace> testCamera() { return studio::cameraFrom<ObjectSpace>({0.3, 0.5, 1}, 40); }

std::vector<scene::ShotLight> testLights() {
  return {scene::ShotDirectionalLight{assume<Direction3<ObjectSpace, double>>(Vec3<double>(0.6, 0, 0.8)),
                                      {3, 3, 3}}};
}

warp::WarpPointer testWarp() { return warp::scaleWarp({1.2, 0.8, 1}, {0, 0, 0}); }

double rootMeanSquare(const image::Image& a, const image::Image& b, const image::Mask& where) {
  return std::sqrt(evaluation::squaredError(a, b, where).mean());
}

TEST(Variants, DirectionsByPolarFactorAreTheProgramsOwn) {
  const PackedStudio packed({}, 1500);
  codec::BlockCache cache(packed.model.files, cacheBytes);
  const auto warp = testWarp();
  surfels::FrameStats stats;
  const image::Image own =
      surfels::renderFrame(packed.model, *warp, testCamera(), testLights(), {}, cache, stats).color;
  const image::Image same =
      withDirections({packed.model, *warp, testCamera(), {}, cache}, byPolarFactor)(testLights());
  EXPECT_LT(rootMeanSquare(own, same, image::objectMask(own)), 1e-6);
  const image::Image other =
      withDirections({packed.model, *warp, testCamera(), {}, cache}, byInverseJacobian)(testLights());
  EXPECT_GT(rootMeanSquare(own, other, image::objectMask(own)), 1e-3);
}

// Under a captured light both blends are that light alone.
TEST(Variants, UnderACapturedLightTheHullAndUlrAgree) {
  const PackedStudio packed({}, 1500);
  codec::BlockCache cache(packed.model.files, cacheBytes);
  const auto none = warp::chainWarp({});
  const auto& light = std::get<capture::DirectionalLight>(packed.capture.lights[4].kind);
  const std::vector<scene::ShotLight> lights{scene::ShotDirectionalLight{
      assume<Direction3<ObjectSpace, double>>(light.towards.raw()), light.irradiance}};
  surfels::FrameStats stats;
  const image::Image own =
      surfels::renderFrame(packed.model, *none, testCamera(), lights, {}, cache, stats).color;
  const image::Image hull = withLightHull({packed.model, *none, testCamera(), {}, cache})(lights);
  EXPECT_LT(rootMeanSquare(own, hull, image::objectMask(own)), 1e-4);
}

TEST(Variants, ColoursUnderAnotherAlphaKeepTheirHue) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> value(0.1f, 1);
  image::Image a(8, 8, 4), b(8, 8, 4);
  for (float& v : a.values) v = value(random);
  for (float& v : b.values) v = value(random);
  for (const size_t c : {0u, 1u, 2u, 3u}) a.values[c] = b.values[4 + c] = 0; // one pixel of each is empty
  const image::Image mixed = underAlphaOf(a, b);
  for (size_t pixel = 0; pixel < 64; ++pixel)
    for (size_t c = 0; c < 4; ++c) {
      const float got = mixed.values[4 * pixel + c];
      if (c == 3 || pixel == 0)
        EXPECT_EQ(got, b.values[4 * pixel + c]);
      else
        EXPECT_NEAR(got * a.values[4 * pixel + 3], a.values[4 * pixel + c] * b.values[4 * pixel + 3], 1e-6);
    }
  EXPECT_EQ(underAlphaOf(a, a).values, a.values); // a ratio of 1 changes nothing
}

// The more surfels, the nearer do splats come to what rays see.
TEST(Variants, SplatsConvergeToTheRayCastSurface) {
  const auto warp = testWarp();
  std::vector<double> differences;
  for (const size_t surfels : {500, 4000, 32000}) {
    const PackedStudio packed({}, surfels);
    codec::BlockCache cache(packed.model.files, cacheBytes);
    const TriangleMesh mesh = readMesh(packed.capture.folder() / packed.capture.geometry);
    const RayCastSurface surface(packed.model, mesh, *warp, {});
    surfels::FrameOptions options;
    options.splats.lowPass = 0.3; // near the pixel's box
    surfels::FrameStats stats;
    const image::Image splats =
        surfels::renderFrame(packed.model, *warp, testCamera(), testLights(), options, cache, stats).color;
    const image::Image rays = surface.view(testCamera(), 4, {}, cache, {})(testLights());
    differences.push_back(rootMeanSquare(splats, rays, image::eroded(image::objectMask(rays), 2)));
    RecordProperty("rms_" + std::to_string(surfels), std::to_string(differences.back()));
  }
  EXPECT_LT(differences[1], differences[0] / 2);
  EXPECT_LT(differences[2], differences[1]);
  EXPECT_LT(differences[2], 2e-3); // of radiances up to 0.6
}

} // namespace
} // namespace surflect::bench
