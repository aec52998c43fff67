#include "render/stage/material/clear_coat.h"

#include "render/stage/material/fresnel.h"
#include "tests/render/stage/material/zoo.h"

#include <gtest/gtest.h>

namespace surflect::material {
namespace {

TEST(ClearCoat, OverBlackIsTheCoatAlone) {
  for (const double mu : {1.0, 0.5, 0.1})
    EXPECT_NEAR(albedo(zoo::coat(0, Lambert{{0, 0, 0}}), zoo::at(mu, 1)).r, dielectricFresnel(mu, 1.5),
                0.002);
}

// Light that enters, is scattered by the base, meets the coat from below, and so on: summed one by one.
TEST(ClearCoat, OverLambertIsTheSumOfAllReflectionsBetween) {
  const double rho = 0.6, eta = 1.5, mu = 0.7;
  const double R = dielectricFresnel(mu, eta), inner = meanDielectricFresnel(1 / eta);
  double base = 0, left = (1 - R) * rho;
  for (int i = 0; i < 100; ++i, left *= inner * rho) base += left * (1 - inner);
  EXPECT_NEAR(albedo(zoo::coat(0, Lambert{{0.6f, 0.6f, 0.6f}}), zoo::at(mu, 1), 1 << 15).r, R + base, 0.001);
}

TEST(ClearCoat, RoughTendsToSmooth) {
  const Lambert base{{0.6f, 0.3f, 0.1f}};
  const auto wo = zoo::at(0.5, 1);
  EXPECT_NEAR(albedo(zoo::coat(0.005, base), wo).r, albedo(zoo::coat(0, base), wo).r, 0.003);
}

// In a varnished mirror too only one direction is seen, twice.
TEST(ClearCoat, OverAMirrorIsSpecular) {
  const Conductor mirror{{0.5f, 0.5f, 0.5f}, {1, 1, 1}, {0, 0}};
  const Material varnished = zoo::coat(0, mirror);
  EXPECT_TRUE(isSpecular(varnished));
  EXPECT_FALSE(isSpecular(zoo::coat(0, Lambert{})));
  const auto wo = zoo::at(0.6, 1);
  const double R = dielectricFresnel(0.6, 1.5), metal = conductorFresnel(0.6, 0.5, 1);
  EXPECT_NEAR(albedo(varnished, wo).r, R + (1 - R) * metal, 1e-3);
}

} // namespace
} // namespace surflect::material
