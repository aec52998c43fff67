#include "srf/ulr/resolution_fade.h"

#include "srf/ulr/visibility_weights.h"
#include "surfel/sampling.h"

#include <gtest/gtest.h>

namespace surflect::ulr {
namespace {

// A camera above the origin that looks down.
capture::Camera<AcquisitionSpace> cameraAbove(double height, double focal) {
  const capture::Lens lens{
      .width = 400, .height = 400, .focalX = focal, .focalY = focal, .centerX = 200, .centerY = 200};
  return {lens, Rigid<CameraSpace, AcquisitionSpace>(Mat3<double>::Identity(), Vec3<double>(0, 0, -height))};
}

double densityFrom(double height, double focal) {
  const auto camera = cameraAbove(height, focal);
  return samplingDensity(camera, capture::Viewpoint(camera), {0, 0, 0});
}

TEST(ResolutionFade, DensityCountsThePixelsOnAUnitOfArea) {
  EXPECT_DOUBLE_EQ(densityFrom(4, 200), 50.0 * 50.0);
  EXPECT_DOUBLE_EQ(densityFrom(8, 400), densityFrom(4, 200));
  auto distant = cameraAbove(4, 30);
  distant.lens.model = capture::Lens::Model::orthographic;
  EXPECT_DOUBLE_EQ(samplingDensity(distant, capture::Viewpoint(distant), {0, 0, 0}), 900);
}

TEST(ResolutionFade, IsOneForTheBestViewAndFallsContinuously) {
  EXPECT_EQ(resolutionFade(3, 3), 1);
  EXPECT_EQ(resolutionFade(3, 6), 1);
  EXPECT_NEAR(resolutionFade(3, 6.000001), 1, 1e-6);
  EXPECT_NEAR(resolutionFade(1, 25), 0.0064, 1e-12); // at five times the distance
  EXPECT_EQ(resolutionFade(1, 0), 1);                // no view sees the surfel
  for (double best = 6; best < 1000; best *= 1.1)
    EXPECT_LT(resolutionFade(3, 1.1 * best), resolutionFade(3, best));
}

TEST(ResolutionFade, AViewFromFarFadesOnlyBesideABetterOne) {
  TriangleMesh square;
  square.positions = {{-0.5f, -0.5f, 0}, {0.5f, -0.5f, 0}, {0.5f, 0.5f, 0}, {-0.5f, 0.5f, 0}};
  square.triangles = {{0, 1, 2}, {0, 2, 3}};
  const SurfelCloud cloud = sampleSurfels(square, 0.1f);
  const RayCaster<AcquisitionSpace> impostor(square);
  const std::vector both{cameraAbove(4, 400), cameraAbove(20, 400)};
  const VisibilityWeights together = visibilityWeights(cloud, both, impostor, {}),
                          alone = visibilityWeights(cloud, std::span(both).last(1), impostor, {});
  for (size_t i = 0; i < cloud.size(); ++i) {
    EXPECT_NEAR(VisibilityWeights::decode(alone.of(i)[0]), 1, 1e-6);
    EXPECT_NEAR(VisibilityWeights::decode(together.of(i)[0]), 1, 1e-6);
    EXPECT_NEAR(VisibilityWeights::decode(together.of(i)[1]), 0.0064, 0.0003);
  }
}

} // namespace
} // namespace surflect::ulr
