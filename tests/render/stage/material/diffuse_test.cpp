#include "render/stage/material/diffuse.h"

#include "tests/render/stage/material/zoo.h"

#include <gtest/gtest.h>

namespace surflect::material {
namespace {

TEST(Lambert, IsAlbedoOverPiTimesTheCosine) {
  const Rgb f = evaluate(Lambert{{0.5f, 0.25f, 1}}, zoo::at(0.6, 1), zoo::at(0.2, 3));
  EXPECT_FLOAT_EQ(f.r, static_cast<float>(0.5 * 0.6 / kPi));
  EXPECT_FLOAT_EQ(f.b, static_cast<float>(0.6 / kPi));
}

TEST(RoughDiffuse, WithoutRoughnessIsLambert) {
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const auto wi = zoo::randomDirection(random), wo = zoo::randomDirection(random);
    const Rgb rough = evaluate(RoughDiffuse{{0.5f, 0.2f, 1}, 0}, wi, wo);
    if (!isAbove(wo)) continue;
    EXPECT_NEAR(rough.r, evaluate(Lambert{{0.5f, 0.2f, 1}}, wi, wo).r, 1e-6);
  }
}

TEST(RoughDiffuse, HasTheAlbedosThatAreStated) {
  for (const double r : {0.2, 1.0}) {
    double mean = 0;
    for (const double mu : {0.02, 0.3, 0.8, 1.0}) {
      double sum = 0;
      constexpr int n = 1000;
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const double x = (i + 0.5) / n; // mu of the light is x^2
          const auto wi = zoo::at(x * x, 2 * kPi * (j + 0.5) / n);
          sum += eon::single(r, wi, zoo::at(mu, 0)) * wi.z() * 4 * x;
        }
      EXPECT_NEAR(eon::directionalAlbedo(r, mu), sum / (n * n), 1e-5) << mu;
    }
    constexpr int n = 100000;
    for (int i = 0; i < n; ++i) {
      const double mu = (i + 0.5) / n;
      mean += eon::directionalAlbedo(r, mu) * 2 * mu / n;
    }
    EXPECT_NEAR(eon::meanAlbedo(r), mean, 1e-8);
  }
}

TEST(RoughDiffuse, IsBrighterTowardsTheLight) {
  const Material rough = RoughDiffuse{{0.5f, 0.5f, 0.5f}, 1};
  const auto light = zoo::at(0.4, 0);
  EXPECT_GT(evaluate(rough, light, zoo::at(0.4, 0)).r, 1.5f * evaluate(rough, light, zoo::at(0.4, kPi)).r);
}

} // namespace
} // namespace surflect::material
