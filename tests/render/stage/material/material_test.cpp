#include "render/stage/material/material.h"

#include "render/stage/material/fresnel.h"
#include "tests/render/stage/material/zoo.h"
#include "tests/support/chi_squared.h"

#include <gtest/gtest.h>

namespace surflect::material {
namespace {

constexpr double kCosines[] = {1, 0.7, 0.3, 0.05, 0.01};

// With an azimuth that is on no axis; glass from both sides.
std::vector<ShadingDirection> viewsOf(const Material& material) {
  std::vector<ShadingDirection> views;
  for (const double mu : kCosines) {
    views.push_back(zoo::at(mu, 0.5));
    if (zoo::isTwoSided(material)) views.push_back(zoo::at(-mu, 0.5));
  }
  return views;
}

double indexAt(const Material& material, const ShadingDirection& w) {
  const auto* dielectric = std::get_if<Dielectric>(&material);
  return dielectric && !isAbove(w) ? dielectric->eta : 1;
}

TEST(Materials, AreReciprocal) {
  std::mt19937 random(1);
  for (const auto& [name, material] : zoo::all()) {
    int compared = 0;
    for (int i = 0; i < 4000; ++i) {
      const auto wi = zoo::randomDirection(random), wo = zoo::randomDirection(random);
      const auto f = [&](const auto& from, const auto& to) {
        const double scale = 1 / (std::abs(from.z()) * squared(indexAt(material, from)));
        return scaled(scale, evaluate(material, from, to));
      };
      const Rgb there = f(wi, wo), back = f(wo, wi);
      compared += there.r > 0;
      constexpr float digits = 1e-30f; // smaller floats have few
      EXPECT_NEAR(there.r, back.r, 1e-5f * there.r + digits) << name;
      EXPECT_NEAR(there.g, back.g, 1e-5f * there.g + digits) << name;
      EXPECT_NEAR(there.b, back.b, 1e-5f * there.b + digits) << name;
    }
    EXPECT_GT(compared, 500) << name;
  }
}

TEST(Materials, ReflectNoMoreThanTheyReceive) {
  for (const auto& [name, material] : zoo::all())
    for (const auto& wo : viewsOf(material)) {
      if (std::holds_alternative<Measured>(material)) continue;
      EXPECT_LT(brightest(albedo(material, wo, 16384)), 1.005) << name << ' ' << wo.z();
    }
}

TEST(Materials, ScatterNothingFromBehindUnlessTheyAreTransparent) {
  std::mt19937 random(2);
  for (const auto& [name, material] : zoo::all())
    for (int i = 0; i < 200; ++i) {
      const auto wi = zoo::randomDirection(random), wo = zoo::randomDirection(random);
      if (zoo::isTwoSided(material) || (isAbove(wi) && isAbove(wo))) continue;
      EXPECT_EQ(evaluate(material, wi, wo), Rgb{}) << name;
      EXPECT_EQ(pdf(material, wi, wo), 0) << name;
      EXPECT_TRUE(isAbove(wo) || !sample(material, wo, {0.5, 0.5, 0.5})) << name;
    }
}

TEST(Materials, SampleWeightsAreEvaluateOverPdf) {
  std::mt19937 random(3);
  for (const auto& [name, material] : zoo::all())
    for (const auto& wo : viewsOf(material))
      for (int i = 0; i < 300; ++i) {
        const auto s = sample(material, wo, zoo::randomUniforms(random));
        if (!s || s->specular) continue;
        const double density = pdf(material, s->wi, wo);
        EXPECT_NEAR(s->pdf, density, 1e-9 * density) << name;
        const Rgb value = evaluate(material, s->wi, wo);
        EXPECT_NEAR(s->weight.r * density, value.r, 1e-5 * value.r + 1e-30) << name;
        EXPECT_NEAR(s->weight.b * density, value.b, 1e-5 * value.b + 1e-30) << name;
        EXPECT_NEAR(length(s->wi), 1, 1e-12) << name;
      }
}

// Along the horizon, along the normal, straight through; and with the length of a float's rounding.
TEST(Materials, StayFiniteAtTheExtremes) {
  std::vector<ShadingDirection> extremes;
  for (const double mu : {1e-300, 1e-12, 1e-6, 1.0})
    for (const double sign : {1.0, -1.0})
      for (const double azimuth : {0.0, kPi / 2, kPi}) {
        const auto w = zoo::at(sign * mu, azimuth);
        extremes.push_back(w);
        extremes.push_back((1 + 1e-7) * w);
      }
  const auto isFine = [](const Rgb& c) {
    return std::isfinite(c.r + c.g + c.b) && c.r >= 0 && c.g >= 0 && c.b >= 0;
  };
  std::mt19937 random(5);
  for (const auto& [name, material] : zoo::all())
    for (const auto& wo : extremes) {
      for (const auto& wi : extremes) {
        EXPECT_TRUE(isFine(evaluate(material, wi, wo))) << name << ' ' << wi.z() << ' ' << wo.z();
        const double density = pdf(material, wi, wo);
        EXPECT_TRUE(std::isfinite(density) && density >= 0) << name << ' ' << wi.z() << ' ' << wo.z();
      }
      for (int i = 0; i < 50; ++i) {
        const auto s = sample(material, wo, zoo::randomUniforms(random));
        EXPECT_TRUE(!s || (isFine(s->weight) && std::abs(length(s->wi) - 1) < 1e-6)) << name << ' ' << wo.z();
      }
    }
}

TEST(Materials, AlbedoIsTheIntegralOfWhatIsEvaluated) {
  for (const auto& [name, material] : zoo::all())
    for (const auto& wo : {zoo::at(0.8, 0.5), zoo::at(0.2, 0.5)}) {
      double sum = 0;
      for (int i = 0; i < 32; ++i)
        sum += chi_squared::integral([&](const auto& wi) { return evaluate(material, wi, wo).r; },
                                     (i % 4) / 2.0 - 1, (i % 4 + 1) / 2.0 - 1, kPi / 4 * (i / 4),
                                     kPi / 4 * (i / 4 + 1), 1e-5);
      const auto* coat = std::get_if<ClearCoat>(&material);
      const double specular = coat && coat->alpha < kSmooth ? dielectricFresnel(wo.z(), coat->eta) : 0;
      EXPECT_NEAR(albedo(material, wo, 1 << 16).r, sum + specular, 0.002) << name << ' ' << wo.z();
    }
}

TEST(Samplers, FollowTheirDensities) {
  const auto zoo = zoo::all();
  int tests = 0;
  for (const auto& [name, material] : zoo) tests += zoo::isTwoSided(material) ? 3 : 2;
  const double limit = chi_squared::sidak(0.01, tests);
  for (const auto& [name, material] : zoo)
    for (const double mu : {0.95, 0.05, -0.4}) {
      if (mu < 0 && !zoo::isTwoSided(material)) continue;
      const auto wo = zoo::at(mu, 0.5);
      const auto result = chi_squared::compare(
          [&](std::mt19937& random) -> std::optional<ShadingDirection> {
            const auto s = sample(material, wo, zoo::randomUniforms(random));
            if (!s || s->specular) return std::nullopt;
            return s->wi;
          },
          [&](const auto& wi) { return pdf(material, wi, wo); }, 50000, 4);
      EXPECT_GT(result.pValue, limit) << name << ' ' << mu;
      EXPECT_NEAR(result.integral, result.returned, 0.01) << name << ' ' << mu;
    }
}

TEST(Materials, OutOfRangeAreRefusedByField) {
  EXPECT_NO_THROW(for (const auto& named : zoo::all()) requireValid(named.material));
  EXPECT_NO_THROW(requireValid(Dielectric{}));
  const auto complaint = [](const Material& material) {
    return image::errorOf([&] { requireValid(material); });
  };
  const double nan = std::nan("");
  EXPECT_EQ(complaint(Lambert{{0.5f, 1.5f, 0}}), "albedo: found 1.5, expected 0 to 1");
  EXPECT_EQ(complaint(Conductor{{1, 1, 1}, {1, 1, 1}, {-0.1, 0.1}}), "alpha.x: found -0.1, expected 0 to 1");
  EXPECT_EQ(complaint(RoughDiffuse{{1, 1, 1}, nan}), "roughness: found nan, expected 0 to 1");
  EXPECT_EQ(complaint(Dielectric{1}), "eta: found 1, expected 0.2 to 5 and not 1");
  EXPECT_EQ(complaint(Dielectric{1.5, 0, {0, -1, 0}}), "absorption: found -1, expected 0 or more");
  EXPECT_EQ(complaint(Ward{{0.7f, 0, 0}, {0.5f, 0, 0}}), "diffuse + specular: found 1.2, expected 0 to 1");
  EXPECT_EQ(complaint(ClearCoat{1.5, 0, Lambert{{0, 0, 2}}}), "base.albedo: found 2, expected 0 to 1");
}

} // namespace
} // namespace surflect::material
