#include "srf/weights/fades.h"

#include "srf/weights/ulr.h"
#include "srf/weights/visibility_weights.h"
#include "surfel/sampling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace surflect::weights {
namespace {

using PreciseDirection = Direction3<AcquisitionSpace, double>;

// Directions spread evenly over a cap around z with this angular radius.
std::vector<PreciseDirection> cap(int count, double radius) {
  std::vector<PreciseDirection> lights;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (i + 0.5) / count * (1 - std::cos(radius)), r = std::sqrt(1 - z * z), turn = 2.4 * i;
    lights.push_back(normalized(PreciseDirection(r * std::cos(turn), r * std::sin(turn), z)));
  }
  return lights;
}

float nearestPenalty(std::span<const PreciseDirection> lights, const PreciseDirection& d) {
  double nearest = 2;
  for (const auto& light : lights) nearest = std::min(nearest, anglePenalty(light, d));
  return static_cast<float>(nearest);
}

PreciseDirection atAngle(double polar, double turn) {
  return {std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), std::cos(polar)};
}

TEST(LightExtrapolationFade, NothingChangesBetweenTheLights) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> turn(0, 2 * std::numbers::pi), z(0, 1);
  for (const double radius : {0.3, 1.2, std::numbers::pi})
    for (const int count : {12, 40, 200}) {
      const auto lights = cap(count, radius);
      const LightExtrapolationFade coverage(lights);
      for (int i = 0; i < 1000; ++i) {
        const double within =
            radius < 3 ? 0.9 * radius : radius; // the outermost lights stop short of the rim
        const double polar = std::acos(1 - z(random) * (1 - std::cos(within)));
        EXPECT_EQ(coverage.at(nearestPenalty(lights, atAngle(polar, turn(random)))), 1)
            << radius << ' ' << count;
      }
    }
}

TEST(LightExtrapolationFade, FarFromEveryLightNothingIsLeft) {
  for (const int count : {12, 40}) {
    const auto lights = cap(count, 0.4);
    const LightExtrapolationFade coverage(lights);
    EXPECT_LT(coverage.spacing(), 0.5);
    for (double polar = 0.4 + 2 * coverage.spacing(); polar < std::numbers::pi; polar += 0.05)
      EXPECT_EQ(coverage.at(nearestPenalty(lights, atAngle(polar, 5 * polar))), 0);
  }
}

TEST(LightExtrapolationFade, FallsSmoothlyAndNeverRises) {
  const LightExtrapolationFade coverage(cap(30, 0.5));
  float last = 1;
  for (int i = 0; i <= 10000; ++i) {
    const float now = coverage.at(static_cast<float>(2e-4 * i));
    EXPECT_LE(now, last);
    EXPECT_LT(last - now, 0.01);
    last = now;
  }
  EXPECT_EQ(last, 0);
}

TEST(LightExtrapolationFade, OneDirectionIsNoRigAndFadesNothing) {
  const PreciseDirection up(0, 0, 1);
  for (const auto& lights : {std::vector<PreciseDirection>{}, {up}, {up, up}}) {
    const LightExtrapolationFade coverage(lights);
    for (const float penalty : {0.f, 1.f, 2.f}) EXPECT_EQ(coverage.at(penalty), 1);
  }
}

TEST(LightExtrapolationFade, TwoOppositeLightsFadeNowhere) {
  const LightExtrapolationFade coverage(std::vector<PreciseDirection>{{0, 0, 1}, {0, 0, -1}});
  EXPECT_EQ(coverage.at(1), 1); // largest possible angle
}

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
} // namespace surflect::weights
