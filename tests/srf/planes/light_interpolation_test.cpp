#include "srf/planes/light_interpolation.h"

#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <random>

namespace surflect::planes {
namespace {

// Directions of the upper hemisphere.
std::vector<Vec3<double>> dome(size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Vec3<double>> lights;
  while (lights.size() < count) {
    const Vec3<double> light = randomUnit(random);
    if (light.z() > 0.1) lights.push_back(light);
  }
  return lights;
}

TEST(LightInterpolation, ACapturedLightHasAllOfItsOwnWeight) {
  const std::vector<Vec3<double>> lights = dome(40, 1);
  const LightInterpolation interpolation(lights);
  for (size_t l = 0; l < lights.size(); ++l) {
    Eigen::VectorXd own = Eigen::VectorXd::Zero(40);
    own[static_cast<Eigen::Index>(l)] = 1;
    EXPECT_LT((interpolation.weights(lights[l]) - own).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(LightInterpolation, WeightsSumToOneAndKeepLinearFunctions) {
  const std::vector<Vec3<double>> lights = dome(20, 2);
  const LightInterpolation interpolation(lights);
  for (const Vec3<double>& towards : dome(50, 3)) {
    const Eigen::VectorXd weights = interpolation.weights(towards);
    Vec3<double> mean = Vec3<double>::Zero();
    for (size_t l = 0; l < lights.size(); ++l) mean += weights[static_cast<Eigen::Index>(l)] * lights[l];
    EXPECT_NEAR(weights.sum(), 1, 1e-10);
    EXPECT_NEAR(mean.x(), towards.x(), 1e-10);
    EXPECT_NEAR(mean.y(), towards.y(), 1e-10);
  }
}

TEST(LightInterpolation, EqualLightsShareTheirWeight) {
  std::vector<Vec3<double>> lights = dome(8, 4);
  lights.push_back(lights.front());
  const Eigen::VectorXd weights = LightInterpolation(lights).weights(lights.front());
  EXPECT_NEAR(weights[0], 0.5, 1e-9);
  EXPECT_NEAR(weights[8], 0.5, 1e-9);
}

TEST(LightInterpolation, LightsOnALineHaveNoSlopeAcross) {
  std::vector<Vec3<double>> lights;
  for (const double x : {-0.6, -0.2, 0.3, 0.7}) lights.emplace_back(x, 0, std::sqrt(1 - x * x));
  const LightInterpolation interpolation(lights);
  const Eigen::VectorXd on = interpolation.weights({0.3, 0, std::sqrt(1 - 0.09)});
  EXPECT_NEAR(on[2], 1, 1e-9);
  EXPECT_NEAR(interpolation.weights({0.1, 0.5, std::sqrt(1 - 0.26)}).sum(), 1, 1e-9);
}

} // namespace
} // namespace surflect::planes
