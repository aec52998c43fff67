#include "render/stage/material/ggx.h"

#include "tests/render/stage/material/zoo.h"
#include "tests/support/chi_squared.h"

#include <gtest/gtest.h>

namespace surflect::material {
namespace {

const Roughness roughnesses[] = {{1, 1}, {0.3, 0.3}, {0.1, 0.6}};

double overHemisphere(const chi_squared::Density& density) {
  double sum = 0;
  for (int i = 0; i < 128; ++i)
    sum += chi_squared::integral(density, i / 16 / 8.0, (i / 16 + 1) / 8.0, kPi / 8 * (i % 16),
                                 kPi / 8 * (i % 16 + 1), 1e-7);
  return sum;
}

TEST(Ggx, FacetsCoverTheSurfaceOnce) {
  for (const Roughness& alpha : roughnesses)
    EXPECT_NEAR(overHemisphere([&](const auto& h) { return ggx::density(h, alpha) * h.z(); }), 1, 1e-5);
}

// Which is what defines masking.  [Heitz 2014, Eq. 14]
TEST(Ggx, VisibleFacetsCoverTheViewOnce) {
  for (const Roughness& alpha : roughnesses)
    for (const double mu : {1.0, 0.5, 0.05}) {
      const auto w = zoo::at(mu, 1);
      EXPECT_NEAR(overHemisphere([&](const auto& h) { return ggx::visibleDensity(h, w, alpha); }), 1, 1e-4);
    }
}

TEST(Ggx, VisibleNormalsFollowTheirDensity) {
  const double limit = chi_squared::sidak(0.01, 9);
  for (const Roughness& alpha : roughnesses)
    for (const double mu : {1.0, 0.5, 0.05}) {
      const auto w = zoo::at(mu, 1);
      const auto result = chi_squared::compare(
          [&](std::mt19937& random) -> std::optional<ShadingDirection> {
            const Uniforms u = zoo::randomUniforms(random);
            return ggx::visibleNormal(w, alpha, u[1], u[2]);
          },
          [&](const auto& h) { return isAbove(h) ? ggx::visibleDensity(h, w, alpha) : 0; }, 100000, 3);
      EXPECT_GT(result.pValue, limit) << alpha.x << ' ' << mu;
    }
}

TEST(Ggx, TurningTheFrameSwapsTheRoughnesses) {
  std::mt19937 random(4);
  const auto turned = [](const ShadingDirection& w) { return ShadingDirection(-w.y(), w.x(), w.z()); };
  for (int i = 0; i < 1000; ++i) {
    const auto h = zoo::randomDirection(random), w = zoo::randomDirection(random);
    if (!isAbove(h) || !isAbove(w)) continue;
    EXPECT_DOUBLE_EQ(ggx::density(h, {0.1, 0.6}), ggx::density(turned(h), {0.6, 0.1}));
    EXPECT_DOUBLE_EQ(ggx::G1(w, {0.1, 0.6}), ggx::G1(turned(w), {0.6, 0.1}));
  }
}

TEST(Ggx, WhatIsUnshadowedIsWhatTheDensitiesSay) {
  std::mt19937 random(5);
  for (int i = 0; i < 1000; ++i) {
    const auto wi = zoo::randomDirection(random), wo = zoo::randomDirection(random);
    if (!isAbove(wi) || !isAbove(wo)) continue;
    const Roughness alpha{0.2, 0.7};
    EXPECT_NEAR(ggx::unshadowed(wi, wo, alpha) * ggx::reflectedDensity(wi, wo, alpha) /
                    ggx::reflected(wi, wo, alpha),
                1, 1e-9);
  }
}

TEST(ChiSquared, KnowsTheTailOfTheDistribution) {
  EXPECT_NEAR(chi_squared::upperGamma(1, 2.5), std::exp(-2.5), 1e-14);
  EXPECT_NEAR(chi_squared::upperGamma(0.5, 1.7), std::erfc(std::sqrt(1.7)), 1e-14);
  EXPECT_NEAR(chi_squared::upperGamma(3, 0.4), std::exp(-0.4) * (1 + 0.4 + 0.08), 1e-14);
}

// A roughness a tenth off is noticed.
TEST(ChiSquared, RejectsADensityThatIsNearlyRight) {
  const auto w = zoo::at(0.5, 1);
  const auto result = chi_squared::compare(
      [&](std::mt19937& random) -> std::optional<ShadingDirection> {
        const Uniforms u = zoo::randomUniforms(random);
        return ggx::visibleNormal(w, {0.33, 0.3}, u[1], u[2]);
      },
      [&](const auto& h) {
        return isAbove(h) ? ggx::visibleDensity(h, w, {0.3, 0.3}) : 0;
      },
      100000, 3);
  EXPECT_LT(result.pValue, 1e-6);
}

} // namespace
} // namespace surflect::material
