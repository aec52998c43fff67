#include "render/stage/material/fresnel.h"

#include <gtest/gtest.h>

#include <random>

namespace surflect::material {
namespace {

// 2 int F mu dmu, substituted so that the horizon is smooth.
template <class F> double hemisphericalMean(const F& fresnel) {
  constexpr int count = 1000000;
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    const double x = (i + 0.5) / count, mu = x * x;
    sum += fresnel(mu) * 2 * mu * 2 * x;
  }
  return sum / count;
}

TEST(DielectricFresnel, AtNormalIncidenceIsTheSquareOfTheContrast) {
  for (const double eta : {0.5, 0.75, 1.33, 1.5, 2.4})
    EXPECT_NEAR(dielectricFresnel(1, eta), std::pow((eta - 1) / (eta + 1), 2), 1e-15);
}

TEST(DielectricFresnel, AtBrewstersAngleOnePolarisationIsLeft) {
  for (const double eta : {0.5, 0.75, 1.33, 1.5, 2.4}) {
    const double mu = 1 / std::sqrt(1 + eta * eta); // tan = eta
    EXPECT_NEAR(dielectricFresnel(mu, eta), std::pow((eta * eta - 1) / (eta * eta + 1), 2) / 2, 1e-15);
  }
}

TEST(DielectricFresnel, IsOneBeyondTheCriticalAngleAndAtTheHorizon) {
  const double critical = std::sqrt(1 - 0.6 * 0.6);
  EXPECT_EQ(dielectricFresnel(critical - 1e-6, 0.6), 1);
  EXPECT_EQ(dielectricFresnel(0.1, 0.6), 1);
  EXPECT_LT(dielectricFresnel(critical + 1e-4, 0.6), 0.96);
  EXPECT_NEAR(dielectricFresnel(1e-12, 1.5), 1, 1e-10);
}

TEST(DielectricFresnel, IsTheSameBothWays) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> cosine(0.01, 1), index(1.1, 3);
  for (int i = 0; i < 1000; ++i) {
    const double mu = cosine(random), eta = index(random);
    const double muT = refractedCosine(mu, eta);
    EXPECT_NEAR(dielectricFresnel(mu, eta), dielectricFresnel(muT, 1 / eta), 1e-12);
    EXPECT_NEAR(refractedCosine(muT, 1 / eta), mu, 1e-12);
  }
}

TEST(DielectricFresnel, HasTheMeanThatIsStated) {
  for (const double eta : {0.4, 0.6667, 0.9, 1.05, 1.33, 1.5, 2.4})
    EXPECT_NEAR(meanDielectricFresnel(eta),
                hemisphericalMean([&](double mu) { return dielectricFresnel(mu, eta); }), 1e-7)
        << eta;
}

TEST(ConductorFresnel, GoesThroughItsColoursAndToOne) {
  EXPECT_DOUBLE_EQ(conductorFresnel(1, 0.6, 0.3), 0.6);
  EXPECT_DOUBLE_EQ(conductorFresnel(0, 0.6, 0.3), 1);
  EXPECT_NEAR(conductorFresnel(1.0 / 7, 0.6, 0.3), 0.3 * schlickFresnel(1.0 / 7, 0.6), 1e-15);
  EXPECT_EQ(conductorFresnel(0.37, 1, 1), 1);
}

TEST(ConductorFresnel, StaysBetweenZeroAndOne) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 10000; ++i) {
    const double mu = uniform(random), F0 = uniform(random), tint = uniform(random);
    const double F = conductorFresnel(mu, F0, tint);
    EXPECT_GE(F, 0);
    EXPECT_LE(F, 1);
  }
}

TEST(ConductorFresnel, HasTheMeanThatIsStated) {
  for (const double tint : {0.3, 0.8, 1.0})
    EXPECT_NEAR(meanConductorFresnel(0.7, tint),
                hemisphericalMean([&](double mu) { return conductorFresnel(mu, 0.7, tint); }), 1e-8);
}

} // namespace
} // namespace surflect::material
