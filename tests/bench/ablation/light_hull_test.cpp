#include "bench/ablation/light_hull.h"

#include "tests/support/synthetic_capture.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <random>

namespace surflect::bench {
namespace {

using Towards = Direction3<AcquisitionSpace>;

Towards randomUnit(std::mt19937& random) {
  std::normal_distribution<float> normal;
  return assume<Towards>(Vec3<float>(normal(random), normal(random), normal(random)).normalized());
}

std::vector<Towards> randomLights(size_t count, std::mt19937& random) {
  std::vector<Towards> lights(count);
  for (auto& light : lights) light = randomUnit(random);
  return lights;
}

Vec3<double> blended(std::span<const Towards> lights, const ulr::BlendSet& blend) {
  Vec3<double> sum = Vec3<double>::Zero();
  for (const auto& [light, weight] : blend) sum += weight * lights[light].raw().cast<double>();
  return sum;
}

TEST(LightHull, BarycentricWeightsReproduceLinearFunctionsInTheTrianglesPlane) {
  std::mt19937 random(1);
  for (int i = 0; i < 1000; ++i) {
    std::array<Vec3<double>, 3> corners;
    for (auto& corner : corners) corner = randomUnit(random).raw().cast<double>();
    const Vec3<double> share = Vec3<double>::Random().cwiseAbs() + Vec3<double>::Constant(0.1);
    const Vec3<double> b = share / share.sum();
    const Vec3<double> point = b[0] * corners[0] + b[1] * corners[1] + b[2] * corners[2];
    Mat3<double> matrix;
    matrix << corners[0], corners[1], corners[2];
    if (std::abs(matrix.determinant()) < 1e-3) continue;
    EXPECT_LT((barycentricWeights(corners, 3 * point) - b).norm(), 1e-11);
  }
}

TEST(LightHull, WeightsArePositiveSumToOneAndStandInTheDirectionAskedFor) {
  std::mt19937 random(2);
  const auto lights = randomLights(40, random);
  const LightHull hull(lights);
  EXPECT_EQ(hull.triangles().size(), 2 * lights.size() - 4); // Euler
  for (int i = 0; i < 2000; ++i) {
    const Towards asked = randomUnit(random);
    const ulr::BlendSet blend = hull.weights(asked);
    float sum = 0;
    for (const auto& [light, weight] : blend) {
      EXPECT_GE(weight, -2e-6f);
      sum += weight;
    }
    EXPECT_NEAR(sum, 1, 1e-6);
    EXPECT_LT((blended(lights, blend).normalized() - asked.raw().cast<double>()).norm(), 1e-6);
  }
}

TEST(LightHull, ACapturedLightIsAnsweredByItself) {
  std::mt19937 random(3);
  const auto lights = randomLights(40, random);
  const LightHull hull(lights);
  for (size_t light = 0; light < lights.size(); ++light)
    for (const auto& [index, weight] : hull.weights(lights[light]))
      EXPECT_NEAR(weight, index == light ? 1 : 0, 1e-5);
}

TEST(LightHull, NoLightLiesOutside) {
  std::mt19937 random(4);
  const auto lights = randomLights(60, random);
  const auto point = [&](uint32_t light) -> Vec3<double> { return lights[light].raw().cast<double>(); };
  for (const auto& t : LightHull(lights).triangles()) {
    const Vec3<double> normal = (point(t[1]) - point(t[0])).cross(point(t[2]) - point(t[0]));
    for (uint32_t light = 0; light < lights.size(); ++light)
      EXPECT_LT(normal.dot(point(light) - point(t[0])), 1e-8);
  }
}

TEST(LightHull, IsContinuous) {
  std::mt19937 random(5);
  std::vector<Towards> lights; // even, so that no triangle is thin
  for (const Vec3<double>& light : studio::spiral(30))
    lights.push_back(assume<Towards>(Vec3<float>(light.cast<float>())));
  const LightHull hull(lights);
  std::vector<double> values(lights.size());
  std::uniform_real_distribution<double> uniform;
  for (double& value : values) value = uniform(random);
  const auto at = [&](const Towards& towards) {
    double sum = 0;
    for (const auto& [light, weight] : hull.weights(towards)) sum += weight * values[light];
    return sum;
  };
  const auto largestChange = [&](float step) {
    std::mt19937 same(6);
    double largest = 0;
    for (int i = 0; i < 5000; ++i) {
      const Towards from = randomUnit(same);
      const Vec3<float> to = (from.raw() + step * randomUnit(same).raw()).normalized();
      largest = std::max(largest, std::abs(at(from) - at(assume<Towards>(to))));
    }
    return largest;
  };
  EXPECT_LT(largestChange(1e-4f), largestChange(1e-3f) / 5); // a jump would stay as it is
}

// The corners of a cube: each face is a square, cut one way or the other.
TEST(LightHull, LightsOfOnePlaneAreTriangulatedWithoutOverlap) {
  std::vector<Towards> lights;
  for (int i = 0; i < 8; ++i)
    lights.push_back(assume<Towards>(
        Vec3<float>(i & 1 ? 1.f : -1.f, i & 2 ? 1.f : -1.f, i & 4 ? 1.f : -1.f).normalized()));
  EXPECT_EQ(LightHull(lights).triangles().size(), 12u);
}

TEST(LightHull, BeyondTheHullTheNearestLightAnswers) {
  std::vector<Towards> lights;
  for (const float x : {0.5f, -0.5f})
    for (const float y : {0.5f, -0.5f}) lights.push_back(assume<Towards>(Vec3<float>(x, y, 1).normalized()));
  const ulr::BlendSet blend =
      LightHull(lights).weights(assume<Towards>(Vec3<float>(0.6f, 0.6f, -0.5f).normalized()));
  ASSERT_EQ(blend.size(), 1u);
  EXPECT_EQ(blend[0].index, 0u);
  EXPECT_EQ(blend[0].weight, 1);
}

} // namespace
} // namespace surflect::bench
