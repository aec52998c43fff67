#include "srf/weights/light_blend.h"

#include "tests/srf/weights/lights.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace surflect::weights {
namespace {

using lights::coverageOf;
using lights::Direction;
using lights::directionOf;
using lights::randomDirection;
using lights::spiral;
using lights::sumOf;
constexpr LightFit fits[] = {LightFit::mean, LightFit::plane};

std::vector<float> lightWeights(std::span<const Direction> lights, const Direction& towards,
                                const LightBlend& how,
                                LightExtrapolation extrapolation = LightExtrapolation::clamp) {
  return surflect::weights::lights::weightsOf(lights, towards, how, coverageOf(lights), extrapolation);
}

double largestDifference(std::span<const float> a, std::span<const float> b) {
  double largest = 0;
  for (size_t i = 0; i < a.size(); ++i) largest = std::max(largest, double{std::abs(a[i] - b[i])});
  return largest;
}

// The sum is 1; with LightExtrapolation::fade it is the coverage.
TEST(LightBlend, WeightsOfAMeanAndThoseToBeForeshortenedSumToTheCoverage) {
  std::mt19937 random(1);
  for (const int count : {1, 2, 3, 7, 60})
    for (const double lowest : {-1.0, 0.8})
      for (const size_t blended : {1, 3, 8})
        for (const LightFit fit : fits) {
          const auto lights = spiral(count, lowest);
          const auto coverage = coverageOf(lights);
          const LightBlend how{blended, fit, fit == LightFit::plane};
          for (int i = 0; i < 100; ++i) {
            const auto towards = randomDirection(random);
            EXPECT_NEAR(sumOf(lightWeights(lights, towards, how)), 1, 5e-7);
            float nearest = 2;
            for (const auto& light : lights) nearest = std::min(nearest, anglePenalty(light, towards));
            EXPECT_NEAR(sumOf(lightWeights(lights, towards, how, LightExtrapolation::fade)),
                        coverage.at(nearest), 5e-7);
          }
        }
}

TEST(LightBlend, ACapturedLightIsAnsweredByItselfAlone) {
  const auto lights = spiral(30);
  for (const LightFit fit : fits)
    for (size_t light = 0; light < lights.size(); ++light) {
      std::vector<float> alone(lights.size());
      alone[light] = 1;
      EXPECT_LT(largestDifference(lightWeights(lights, lights[light], {4, fit}), alone), 1e-11);
    }
}

// sum w'_i l_i = l except for the part of m that the ridge leaves, r tr(C) (C + r tr(C) I)^-1 m. That part is
// perpendicular to l if no blended light is beyond 60 degrees; among six lights some are.
TEST(LightBlend, ThePlanesLightsHaveTheVectorIrradianceAskedForButForTheRidge) {
  std::mt19937 random(2);
  size_t distant = 0;
  for (const int count : {6, 100}) {
    const auto lights = spiral(count);
    for (int i = 0; i < 200; ++i) {
      const auto towards = randomDirection(random);
      const Vec3<double> l = towards.raw().cast<double>();
      const auto mean = lightWeights(lights, towards, {4, LightFit::mean});
      const auto plane = lightWeights(lights, towards, {4, LightFit::plane});
      std::vector<Vec3<double>> x;
      Vec3<double> m = Vec3<double>::Zero(), got = Vec3<double>::Zero();
      bool isNear = true;
      for (size_t k = 0; k < lights.size(); ++k) {
        const Vec3<double> light = lights[k].raw().cast<double>();
        x.emplace_back(light / std::max(0.5, light.dot(l)) - l);
        m += mean[k] * x[k];
        got += plane[k] * light;
        isNear &= mean[k] == 0 || light.dot(l) > 0.5;
      }
      Mat3<double> C = Mat3<double>::Zero();
      for (size_t k = 0; k < lights.size(); ++k) C += mean[k] * (x[k] - m) * (x[k] - m).transpose();
      const double ridge = 0.1 * C.trace();
      const Vec3<double> missed = ridge * (C + ridge * Mat3<double>::Identity()).inverse() * m;
      EXPECT_LT((got - l - missed).norm(), 2e-6);
      if (isNear) {
        EXPECT_NEAR(got.dot(l), 1, 2e-6);
      }
      distant += !isNear;
    }
  }
  EXPECT_GT(distant, 100u);
}

TEST(LightBlend, FadingMultipliesByTheCoverage) {
  std::mt19937 random(7);
  const auto lights = spiral(20, 0.6);
  const auto coverage = coverageOf(lights);
  size_t within = 0; // directions where the coverage fades
  for (int i = 0; i < 1000; ++i) {
    const auto towards = randomDirection(random);
    float nearest = 2;
    for (const auto& light : lights) nearest = std::min(nearest, anglePenalty(light, towards));
    const float covered = coverage.at(nearest);
    auto expected = lightWeights(lights, towards, {4, LightFit::plane});
    for (float& weight : expected) weight *= covered;
    const auto faded = lightWeights(lights, towards, {4, LightFit::plane}, LightExtrapolation::fade);
    EXPECT_LT(largestDifference(faded, expected), 1e-6);
    within += covered > 0 && covered < 1;
  }
  EXPECT_GT(within, 50u);
}

TEST(LightBlend, BeyondTheCoverageThePlaneIsTheMean) {
  const auto lights = spiral(20, 0.7);
  std::mt19937 random(3);
  for (int i = 0; i < 100; ++i) {
    const auto towards = randomDirection(random);
    if (towards.raw().z() > 0) continue;
    EXPECT_EQ(lightWeights(lights, towards, {4, LightFit::plane}),
              lightWeights(lights, towards, {4, LightFit::mean}));
  }
}

// Steps sixteen times smaller give changes about sixteen times smaller, everywhere: through captured lights,
// and where one light replaces another.
TEST(LightBlend, IsContinuousAlongEveryPath) {
  std::mt19937 random(4);
  const auto lights = spiral(30);
  for (const LightFit fit : fits)
    for (size_t path = 0; path < 10; ++path) {
      const Vec3<double> start = lights[3 * path].raw().cast<double>();
      const Vec3<double> side = start.cross(randomDirection(random).raw().cast<double>()).normalized();
      const auto largestChange = [&](double step) {
        double largest = 0;
        std::vector<float> before;
        for (double angle = -0.5; angle < 0.5; angle += step) {
          const Vec3<double> towards = std::cos(angle) * start + std::sin(angle) * side;
          const auto now = lightWeights(lights, directionOf(towards), {4, fit});
          if (!before.empty()) largest = std::max(largest, largestDifference(now, before));
          before = now;
        }
        return largest;
      };
      EXPECT_LT(largestChange(0.001 / 16), largestChange(0.001) / 6) << path;
    }
}

TEST(LightBlend, TurnsWithTheLights) {
  std::mt19937 random(5);
  const auto lights = spiral(30);
  const Mat3<double> turn = Eigen::Quaterniond(0.3, -0.8, 0.2, 0.5).normalized().toRotationMatrix();
  std::vector<Direction> turned;
  for (const auto& light : lights) turned.push_back(directionOf(turn * light.raw().cast<double>()));
  for (int i = 0; i < 200; ++i) {
    const auto towards = randomDirection(random);
    const auto still = lightWeights(lights, towards, {4, LightFit::plane});
    const auto moved =
        lightWeights(turned, directionOf(turn * towards.raw().cast<double>()), {4, LightFit::plane});
    EXPECT_LT(largestDifference(still, moved), 5e-7);
  }
}

TEST(LightBlend, LightsInOneLineOrInOnePlaceHaveBoundedWeights) {
  std::vector<Direction> lights(5, directionOf({0, 0, 1}));
  for (const double angle : {0.1, 0.2, 0.3})
    lights.push_back(directionOf({std::sin(angle), 0, std::cos(angle)}));
  for (int i = 0; i < 200; ++i) {
    const double a = 0.002 * i;
    const auto weights =
        lightWeights(lights, directionOf({std::sin(a), 0.1, std::cos(a)}), {4, LightFit::plane});
    for (const float weight : weights) EXPECT_LT(std::abs(weight), 3);
  }
}

} // namespace
} // namespace surflect::weights
