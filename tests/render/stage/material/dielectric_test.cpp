#include "render/stage/material/dielectric.h"

#include "render/stage/material/fresnel.h"
#include "tests/render/stage/material/zoo.h"

#include <gtest/gtest.h>

namespace surflect::material {
namespace {

const Dielectric smooth{};

// R + (1-R)^2 R (1 + R^2 + ...) = 2 R / (1 + R): by walks through a plate.
TEST(Dielectric, APlateReflectsTwoROverOnePlusR) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  constexpr int walks = 200000;
  for (const double mu : {1.0, 0.5, 0.2}) {
    int reflected = 0;
    for (int i = 0; i < walks; ++i) {
      ShadingDirection away = zoo::at(mu, 0.7); // from the surface at hand, in its frame
      bool inside = false, onTop = true;
      for (;;) {
        const auto s = sample(smooth, away, {uniform(random), 0, 0});
        ASSERT_TRUE(s->specular);
        ASSERT_EQ(s->weight, (Rgb{1, 1, 1}));
        inside = !isAbove(s->wi);
        if (!inside) break;
        onTop = !onTop;
        away = {-s->wi.x(), s->wi.y(), s->wi.z()}; // the other face's frame is turned, and the ray's end
      }
      reflected += onTop;
    }
    const double R = dielectricFresnel(mu, 1.5), expected = 2 * R / (1 + R);
    EXPECT_NEAR(reflected / double{walks}, expected, 4 * std::sqrt(expected * (1 - expected) / walks)) << mu;
  }
}

TEST(Dielectric, RefractsAsSnellSays) {
  for (const double mu : {0.9, 0.3, -0.9, -0.8}) {
    const auto wo = zoo::at(mu, 0.7);
    const auto s = sample(smooth, wo, {0.99999, 0, 0});
    EXPECT_LT(s->wi.z() * wo.z(), 0);
    const double eta = mu > 0 ? 1.5 : 1 / 1.5;
    EXPECT_NEAR(s->wi.x(), -wo.x() / eta, 1e-15);
    EXPECT_NEAR(s->wi.y(), -wo.y() / eta, 1e-15);
    EXPECT_NEAR(length(s->wi), 1, 1e-15);
  }
}

TEST(Dielectric, ReflectsAllBeyondTheCriticalAngle) {
  const auto s = sample(smooth, zoo::at(-0.5, 0.7), {0.999999, 0, 0});
  EXPECT_NEAR(s->wi.z(), -0.5, 1e-15);
}

TEST(Dielectric, TendsToASmoothOne) {
  std::mt19937 random(2);
  const auto wo = zoo::at(0.6, 0.7), bent = sample(smooth, wo, {0.9999, 0, 0})->wi;
  for (const double alpha : {0.05, 0.002}) {
    const Dielectric rough{1.5, alpha, {0, 0, 0}, &zoo::glassLosses()};
    int passed = 0, near = 0;
    double reflected = 0;
    for (int i = 0; i < 20000; ++i) {
      const auto s = sample(rough, wo, zoo::randomUniforms(random));
      if (!s) continue;
      if (isAbove(s->wi)) reflected += s->weight.r;
      passed += !isAbove(s->wi);
      near += !isAbove(s->wi) && length(s->wi + -bent) < 3 * alpha;
    }
    EXPECT_GT(near, 0.9 * passed) << alpha;
    EXPECT_NEAR(reflected / 20000, dielectricFresnel(0.6, 1.5), 0.05 * alpha + 0.008) << alpha;
  }
}

// Other indices than the zoo's; 8/9 is water before glass.
TEST(Dielectric, IsWhiteForOtherIndices) {
  for (const double eta : {1.33, 2.4, 8.0 / 9}) {
    const DielectricLosses losses(eta);
    for (const double alpha : {0.1, 0.5})
      for (const double mu : {1.0, 0.3, 0.05, -0.05, -0.3, -1.0})
        EXPECT_NEAR(albedo(Dielectric{eta, alpha, {0, 0, 0}, &losses}, zoo::at(mu, 0.7), 1 << 14).r, 1, 0.005)
            << eta << ' ' << alpha << ' ' << mu;
  }
}

TEST(Dielectric, AbsorptionOfPathsMultiplies) {
  const Rgb absorption{0.5f, 2, 0};
  const Rgb part = transmittance(absorption, 0.3), rest = transmittance(absorption, 0.4);
  EXPECT_NEAR(transmittance(absorption, 0.7).g, (part * rest).g, 1e-7);
  EXPECT_NEAR(transmittance(absorption, 1).r, std::exp(-0.5), 1e-7);
  EXPECT_EQ(transmittance(absorption, 100).b, 1);
}

} // namespace
} // namespace surflect::material
