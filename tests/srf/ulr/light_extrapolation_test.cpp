#include "srf/ulr/light_extrapolation.h"

#include "srf/ulr/ulr.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace surflect::ulr {
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

} // namespace
} // namespace surflect::ulr
