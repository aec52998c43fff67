#include "render/stage/material/energy_compensation.h"

#include "render/stage/material/ggx.h"
#include "tests/render/stage/material/zoo.h"
#include "tests/support/chi_squared.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

namespace surflect::material {
namespace {

// Over directions of light, not over facets.
double lossByDirections(const ShadingDirection& wo, const Roughness& alpha) {
  double sum = 0;
  for (int i = 0; i < 128; ++i)
    sum += chi_squared::integral(
        [&](const auto& wi) { return isAbove(wi) ? ggx::reflected(wi, wo, alpha) : 0; }, i / 16 / 8.0,
        (i / 16 + 1) / 8.0, kPi / 8 * (i % 16), kPi / 8 * (i % 16 + 1), 1e-6);
  return 1 - sum;
}

TEST(EnergyCompensation, IsTheLossOfSingleReflection) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 60; ++i) {
    const auto wo = zoo::at(std::max(0.01, uniform(random)), 2 * kPi * uniform(random));
    const double most = 0.05 + 0.95 * uniform(random), ratio = i % 3 == 0 ? 1 : 0.1 + 0.9 * uniform(random);
    const Roughness alpha = i % 2 ? Roughness{most, most * ratio} : Roughness{most * ratio, most};
    EXPECT_NEAR(zoo::mirrorLoss().loss(wo, alpha), lossByDirections(wo, alpha), 0.004)
        << wo.z() << ' ' << alpha.x << ' ' << alpha.y;
  }
}

// So that what is given back is what is lost.
TEST(EnergyCompensation, HasTheMeanOfItsLosses) {
  const auto meanOf = [](const EnergyCompensation& table, const Roughness& alpha) {
    constexpr int cosines = 1000, azimuths = 32;
    double sum = 0;
    for (int i = 0; i < cosines; ++i)
      for (int j = 0; j < azimuths; ++j) {
        const double x = (i + 0.5) / cosines; // mu = x^3
        sum += table.loss(zoo::at(x * x * x, 2 * kPi * (j + 0.5) / azimuths), alpha) * 6 * std::pow(x, 5);
      }
    return sum / (cosines * azimuths);
  };
  for (const double most : {0.01, 0.05, 0.13, 0.4, 0.77, 1.0}) {
    for (const double ratio : {0.05, 0.33, 0.71, 1.0}) {
      const Roughness alpha{most * ratio, most};
      const double mean = meanOf(zoo::mirrorLoss(), alpha);
      EXPECT_NEAR(zoo::mirrorLoss().meanLoss(alpha), mean, 0.005 * mean) << most << ' ' << ratio;
    }
    const Roughness alpha{most, most};
    for (const EnergyCompensation* table :
         {&zoo::glassLosses().outside, &zoo::glassLosses().inside, &zoo::coatTransmission().table})
      EXPECT_NEAR(table->meanLoss(alpha), meanOf(*table, alpha), 0.005 * meanOf(*table, alpha)) << most;
  }
}

TEST(EnergyCompensation, TurningTheFrameSwapsTheRoughnesses) {
  std::mt19937 random(2);
  for (int i = 0; i < 500; ++i) {
    const auto w = zoo::randomDirection(random);
    const ShadingDirection turned(-w.y(), w.x(), w.z());
    EXPECT_NEAR(zoo::mirrorLoss().loss(w, {0.1, 0.6}), zoo::mirrorLoss().loss(turned, {0.6, 0.1}), 1e-12);
  }
}

TEST(EnergyCompensation, IsTheSameForAnyNumberOfThreads) {
  zoo::coatTransmission(); // by all of them
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const CoatTransmission alone(1.5);
  std::mt19937 random(4);
  for (int i = 0; i < 1000; ++i) {
    const auto w = zoo::randomDirection(random);
    const double alpha = 0.001 * (i + 1);
    EXPECT_EQ(alone.table.loss(w, {alpha, alpha}), zoo::coatTransmission().table.loss(w, {alpha, alpha}));
    EXPECT_EQ(alone.table.meanLoss({alpha, alpha}), zoo::coatTransmission().table.meanLoss({alpha, alpha}));
  }
}

TEST(EnergyCompensation, GrazingDirectionsFollowTheirDensity) {
  for (const double alpha : {0.02, 0.3, 1.0}) {
    const Roughness roughness{alpha, alpha};
    const auto result = chi_squared::compare(
        [&](std::mt19937& random) -> std::optional<ShadingDirection> {
          const Uniforms u = zoo::randomUniforms(random);
          return grazingDirection(roughness, u[1], u[2]);
        },
        [&](const auto& w) { return isAbove(w) ? grazingDensity(w, roughness) : 0; }, 100000, 3);
    EXPECT_GT(result.pValue, chi_squared::sidak(0.01, 3)) << alpha;
    EXPECT_NEAR(result.integral, 1, 1e-3) << alpha;
  }
}

} // namespace
} // namespace surflect::material
