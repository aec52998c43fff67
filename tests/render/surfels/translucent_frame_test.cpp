// Frames of translucent objects.
#include "render/surfels/develop.h"
#include "render/surfels/frame.h"
#include "render/surfels/reference.h"
#include "tests/render/films.h"
#include "tests/render/scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

namespace surflect::surfels {
namespace {

using studio::cameraFrom;
using studio::filmOf;
using studio::PackedStudio;
using studio::pictureSize;
using studio::Studio;

constexpr float kOpacity = 0.55f;
constexpr uint8_t kLevel = 140; // the nearest to it

class TranslucentSphere : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    translucent = std::make_unique<PackedStudio>(Studio{.size = pictureSize, .opacity = kOpacity}, 2000);
    // Alpha is constant, also beyond the outlines of the photographs.
    for (codec::AlphaPlane& plane : translucent->model.alpha) {
      const std::vector<uint8_t> levels(plane.levels().size(), kLevel);
      plane = codec::AlphaPlane(plane.width(), plane.height(), levels);
    }
  }
  static void TearDownTestSuite() { translucent.reset(); }

  static inline std::unique_ptr<PackedStudio> translucent;
  const capture::Camera<ObjectSpace> camera = cameraFrom<ObjectSpace>({0.3, 0.5, 1}, pictureSize);
  const std::vector<scene::ShotLight> lights{scene::ShotDirectionalLight{
      assume<Direction3<ObjectSpace, double>>(Vec3<double>(0.48, 0.6, 0.64)), {3, 2, 1}}};
  const image::Mask interior = studio::interiorOf(studio::viewSphere(camera, 1));
};

TEST_F(TranslucentSphere, AConstantAlphaComesBackAndColoursAreMultipliedByIt) {
  FrameOptions withoutAlpha;
  withoutAlpha.shade.usesAlpha = false;
  const image::Image solid =
                         filmOf(translucent->model, *studio::noWarp(), camera, lights, withoutAlpha).color,
                     glass = filmOf(translucent->model, *studio::noWarp(), camera, lights).color;
  for (size_t pixel = 0; pixel < interior.inside.size(); ++pixel) {
    if (!interior.inside[pixel]) continue;
    EXPECT_EQ(solid.values[4 * pixel + 3], 1);
    EXPECT_NEAR(glass.values[4 * pixel + 3], kOpacity, 1. / 255);
    for (size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(glass.values[4 * pixel + c], kLevel / 255. * solid.values[4 * pixel + c], 1e-5);
  }
}

TEST_F(TranslucentSphere, AlphaIsBentAndRelitWithItsSurfels) {
  const auto warp = warp::twistWarp(Vec3<double>(0, 1, 0), Angle::fromDegrees(40), Vec3<double>::Zero());
  const std::vector<scene::ShotLight> other{scene::ShotDirectionalLight{
      assume<Direction3<ObjectSpace, double>>(Vec3<double>(0.6, 0, 0.8)), {1, 4, 2}}};
  const image::Image glass = filmOf(translucent->model, *warp, camera, other).color;
  for (size_t pixel = 0; pixel < interior.inside.size(); ++pixel)
    if (interior.inside[pixel]) {
      EXPECT_NEAR(glass.values[4 * pixel + 3], kOpacity, 1. / 255);
    }
}

TEST_F(TranslucentSphere, KrigingBlendsTheSameAlpha) {
  FrameOptions options;
  options.shade.interpolation = weights::Interpolation::kriging;
  auto two = lights;
  two.push_back(scene::ShotDirectionalLight{
      assume<Direction3<ObjectSpace, double>>(Vec3<double>(0, 0.6, 0.8)), {1, 1, 1}});
  const image::Image glass = filmOf(translucent->model, *studio::noWarp(), camera, two, options).color;
  for (size_t pixel = 0; pixel < interior.inside.size(); ++pixel)
    if (interior.inside[pixel]) {
      EXPECT_NEAR(glass.values[4 * pixel + 3], kOpacity, 1. / 255);
    }
}

TEST_F(TranslucentSphere, TheReferenceDrawsTheSame) {
  FrameOptions options;
  options.shade.interpolation = weights::Interpolation::separate;
  options.shade.foreshortened = false;
  codec::BlockCache cache(translucent->model.files, size_t{1} << 28);
  const image::Image fast = filmOf(translucent->model, *studio::noWarp(), camera, lights, options).color;
  const ReferenceFrame plain =
      referenceFrame(translucent->model, *studio::noWarp(), camera, lights, options, cache);
  EXPECT_LT(studio::largestDifference(fast, plain.color), 1e-4);
}

// Two sheets, one behind the other, in one colour and alpha, whose places at rest are given.
image::Image sheets(const Vec3<float>& restOfBack) {
  testing::Rng rng(3);
  testing::Scene scene;
  scene.add(testing::sheet(1, 1, 0.03, 0.1, rng), testing::unmoved, testing::constant(testing::red));
  const size_t front = scene.rest.size();
  scene.add(
      testing::sheet(1, 1, 0.03, 0.1, rng),
      [](const testing::V3& p) { return testing::V3(p - testing::V3(0, 0, 1)); },
      testing::constant(testing::green));
  const auto camera = testing::lookAt({0, 0, 6}, {0, 0, 0}, 64, 64, 200);
  const splat::SplatRaster raster = splat::rasterize(camera, scene.splats(), {.keepsHidden = true});
  std::vector<float> values, clearance(raster.visible.size(), 0.06f);
  std::vector<Point3<AcquisitionSpace>> p0;
  const std::vector<Direction3<AcquisitionSpace>> towards(
      raster.visible.size(), assume<Direction3<AcquisitionSpace>>(Vec3<float>(0, 0, 1)));
  for (const uint32_t i : raster.visible) {
    for (int k = 0; k < 4; ++k) values.push_back(kOpacity);
    p0.push_back(assume<Point3<AcquisitionSpace>>(i < front ? Vec3<float>::Zero() : restOfBack));
  }
  return compositeLayers(raster, values, {}, {p0, towards, clearance});
}

TEST(CompositeLayers, ALayerThatThePhotographsShowedBehindIsNotAddedAgain) {
  EXPECT_NEAR(sheets({0, 0, -1}).at(32, 32)[3], kOpacity, 1e-5);
}

TEST(CompositeLayers, ALayerThatCameToLieBehindIsAddedByOver) {
  const float both = kOpacity + (1 - kOpacity) * kOpacity;
  EXPECT_NEAR(sheets({1, 0, -1}).at(32, 32)[3], both, 1e-5);
  EXPECT_NEAR(sheets({0, 0, 1}).at(32, 32)[3], both, 1e-5);
}

} // namespace
} // namespace surflect::surfels
