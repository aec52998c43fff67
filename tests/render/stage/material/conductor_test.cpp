#include "render/stage/material/conductor.h"

#include "render/stage/material/fresnel.h"
#include "tests/render/stage/material/zoo.h"

#include <gtest/gtest.h>

namespace surflect::material {
namespace {

const Rgb gold{1, 0.7f, 0.3f}, tint{0.9f, 0.8f, 1};

TEST(Conductor, WithoutRoughnessIsAMirror) {
  const Conductor mirror{gold, tint, {0, 0}};
  const auto wo = zoo::at(0.4, 1);
  EXPECT_TRUE(isSpecular(mirror));
  EXPECT_EQ(evaluate(mirror, zoo::at(0.4, 1 + kPi), wo), Rgb{});
  const auto s = sample(mirror, wo, {0.1, 0.2, 0.3});
  EXPECT_TRUE(s->specular);
  EXPECT_NEAR(length(s->wi + -zoo::at(0.4, 1 + kPi)), 0, 1e-15);
  EXPECT_FLOAT_EQ(s->weight.g, static_cast<float>(conductorFresnel(0.4, gold.g, tint.g)));
}

// alpha 0.002 on: samples gather around the mirrored direction, and carry Fresnel's colour.
TEST(Conductor, TendsToAMirror) {
  std::mt19937 random(1);
  const auto wo = zoo::at(0.4, 1), mirror = zoo::at(0.4, 1 + kPi);
  for (const double alpha : {0.05, 0.01, 0.002}) {
    const Conductor conductor{gold, tint, {alpha, alpha}, &zoo::mirrorLoss()};
    std::vector<double> away;
    for (int i = 0; i < 1000; ++i)
      if (const auto s = sample(conductor, wo, zoo::randomUniforms(random)))
        away.push_back(length(s->wi + -mirror));
    std::ranges::nth_element(away, away.begin() + 500);
    EXPECT_LT(away[500], 3 * alpha);
    const double error = std::abs(double{albedo(conductor, wo).g} - conductorFresnel(0.4, gold.g, tint.g));
    EXPECT_LT(error, 0.1 * alpha);
  }
}

TEST(Conductor, TurningTheFrameSwapsTheRoughnesses) {
  std::mt19937 random(2);
  const auto turned = [](const ShadingDirection& w) { return ShadingDirection(-w.y(), w.x(), w.z()); };
  const Conductor along{gold, tint, {0.05, 0.5}, &zoo::mirrorLoss()},
      across{gold, tint, {0.5, 0.05}, &zoo::mirrorLoss()};
  for (int i = 0; i < 1000; ++i) {
    const auto wi = zoo::randomDirection(random), wo = zoo::randomDirection(random);
    const float f = evaluate(along, wi, wo).g;
    EXPECT_NEAR(evaluate(across, turned(wi), turned(wo)).g, f, 1e-6 * f);
    const double p = pdf(along, wi, wo);
    EXPECT_NEAR(pdf(across, turned(wi), turned(wo)), p, 1e-9 * p);
  }
}

// Smooth along x, rough across: half vectors spread along y.
TEST(Conductor, AFibreSpreadsLightAcross) {
  const Conductor fibre{{1, 1, 1}, {1, 1, 1}, {0.05, 0.5}, &zoo::mirrorLoss()};
  const auto wo = zoo::at(1, 0);
  EXPECT_GT(evaluate(fibre, zoo::at(0.8, kPi / 2), wo).r, 30 * evaluate(fibre, zoo::at(0.8, 0), wo).r);
}

// With p_n the share of light that leaves after n facets, sum p_n = 1, the surface reflects sum p_n F^n: at
// least p_1 F, at most p_1 F + (1 - p_1) F^2.
TEST(Conductor, WhatIsReflectedTwiceIsMoreSaturated) {
  const auto wo = zoo::at(0.8, 0);
  const double once = 1 - zoo::mirrorLoss().loss(wo, {1, 1});
  const Rgb seen = albedo(zoo::conductor(1, 1, {1, 0.5f, 0.1f}), wo);
  for (const auto& [color, reflected] : {std::pair{0.5, seen.g}, {0.1, seen.b}}) {
    const double F = meanConductorFresnel(color, 1);
    EXPECT_GT(reflected, once * color);
    EXPECT_LT(reflected, once * F + (1 - once) * F * F);
  }
}

} // namespace
} // namespace surflect::material
