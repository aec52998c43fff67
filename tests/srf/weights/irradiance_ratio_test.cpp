#include "srf/weights/irradiance_ratio.h"

#include "tests/srf/weights/lights.h"

#include <gtest/gtest.h>

namespace surflect::weights {
namespace {

using lights::directionOf;
using lights::randomDirection;
using lights::spiral;

Normal3<AcquisitionSpace> normalOf(const Direction3<AcquisitionSpace>& d) {
  return assume<Normal3<AcquisitionSpace>>(d.raw());
}

struct Face {
  Normal3<AcquisitionSpace> normal;
  std::vector<float> cosines; // one per light

  Face(std::span<const Direction3<AcquisitionSpace>> lights, const Normal3<AcquisitionSpace>& n) : normal(n) {
    for (const auto& light : lights) cosines.push_back(foreshortenedCosine(n, light));
  }
  float factor(const Direction3<AcquisitionSpace>& towards, const BlendSet& blend) const {
    return foreshortening(foreshortenedCosine(normal, towards), blendedCosine(blend, cosines));
  }
};

TEST(Foreshortening, AMatteSurfaceComesOutExactly) {
  std::mt19937 random(1);
  const auto lights = spiral(60);
  const auto coverage = lights::coverageOf(lights);
  int bounded = 0;
  for (int i = 0; i < 5000; ++i) {
    const Face face(lights, normalOf(randomDirection(random)));
    const auto towards = randomDirection(random);
    for (const LightFit fit : {LightFit::mean, LightFit::plane}) {
      const BlendSet blend = blendOfLights(lights, towards, {4, fit}, coverage, LightExtrapolation::clamp);
      const float wanted = foreshortenedCosine(face.normal, towards);
      const float mean = blendedCosine(blend, face.cosines), factor = face.factor(towards, blend);
      if (factor == 2) { // the requested light grazes, and the blended lights graze even more
        EXPECT_LT(mean, wanted / 2 + 1e-3f);
        ++bounded;
        continue;
      }
      if (mean >= 0) {                                 // the mean of a plane can be negative
        EXPECT_NEAR(factor * mean, wanted, 1.001e-3f); // residual
      }
    }
  }
  EXPECT_LT(bounded, 100);
}

TEST(Foreshortening, ACapturedLightKeepsItsWeight) {
  std::mt19937 random(2);
  const auto lights = spiral(30);
  const auto coverage = lights::coverageOf(lights);
  for (size_t light = 0; light < lights.size(); ++light) {
    const Face face(lights, normalOf(randomDirection(random)));
    const BlendSet blend =
        blendOfLights(lights, lights[light], {3, LightFit::mean}, coverage, LightExtrapolation::clamp);
    EXPECT_NEAR(face.factor(lights[light], blend), 1, 1e-6);
  }
}

TEST(Foreshortening, ASurfaceTurnedAwayIsAlmostDark) {
  std::mt19937 random(3);
  const auto lights = spiral(30);
  const auto coverage = lights::coverageOf(lights);
  for (int i = 0; i < 2000; ++i) {
    const Face face(lights, normalOf(randomDirection(random)));
    const auto towards = randomDirection(random);
    if (dot(face.normal, towards) > 0) continue;
    const BlendSet blend =
        blendOfLights(lights, towards, {3, LightFit::mean}, coverage, LightExtrapolation::clamp);
    EXPECT_LT(face.factor(towards, blend) * blendedCosine(blend, face.cosines), 1e-3);
    EXPECT_GT(face.factor(towards, blend), 0);
  }
}

TEST(Foreshortening, WhatFadesIsForeshortenedAlike) {
  std::mt19937 random(4);
  const auto lights = spiral(20, 0.5);
  const auto coverage = lights::coverageOf(lights);
  for (int i = 0; i < 2000; ++i) {
    const Face face(lights, normalOf(randomDirection(random)));
    const auto towards = randomDirection(random);
    const auto factor = [&](LightExtrapolation extrapolation) {
      return face.factor(towards,
                         blendOfLights(lights, towards, {3, LightFit::mean}, coverage, extrapolation));
    };
    const BlendSet faded =
        blendOfLights(lights, towards, {3, LightFit::mean}, coverage, LightExtrapolation::fade);
    if (std::ranges::any_of(faded, [](const Blended& b) { return b.weight > 1e-3f; })) {
      EXPECT_NEAR(factor(LightExtrapolation::fade), factor(LightExtrapolation::clamp), 1e-4f);
    } else {
      EXPECT_TRUE(std::isfinite(factor(LightExtrapolation::fade)));
    }
  }
}

TEST(IrradianceRatio, OfWhatWasCapturedIsOneAndNothingInTheDark) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> strength(0.1f, 10);
  for (int i = 0; i < 50; ++i) {
    const Rgb captured{strength(random), strength(random), 0};
    EXPECT_EQ(irradianceRatio(captured, captured), (Rgb{1, 1, 0}));
    EXPECT_EQ(irradianceRatio(4 * captured, captured), (Rgb{4, 4, 0}));
    EXPECT_EQ(irradianceRatio({1, 1, 1}, captured).b, 0);
  }
}

capture::Light lamp(Rgb irradiance) {
  return {"L", "L", capture::DirectionalLight{Direction3<AcquisitionSpace, double>(0, 0, 1), irradiance}};
}
capture::Light bulb(Rgb intensity) {
  return {"P", "P", capture::PointLight{Point3<AcquisitionSpace, double>(1, 2, 3), intensity}};
}

TEST(CapturedLights, ColourAndStrengthOfLampsOfOneColourAreTheRatio) {
  const Rgb color{0.3f, 1.7f, 0.9f}, now{2, 3, 5};
  const std::vector<capture::Light> lights{lamp(color), bulb(3 * color), lamp(0.1f * color)};
  CapturedLights rig(lights);
  rig.moveTo(Point3<AcquisitionSpace, double>(0.5, -1, 0.25));
  rig.evaluateAll();
  ASSERT_TRUE(rig.inverseColor());
  for (size_t light = 0; light < lights.size(); ++light) {
    const Eigen::Array4f ratio = rig.ratio({1, now.r, now.g, now.b}, light);
    const Rgb made = rig.inverseStrength(light) * (*rig.inverseColor() * now);
    EXPECT_NEAR(made.r / ratio[1], 1, 5e-7);
    EXPECT_NEAR(made.g / ratio[2], 1, 5e-7);
    EXPECT_NEAR(made.b / ratio[3], 1, 5e-7);
  }
}

TEST(CapturedLights, WhiteLampsOfAnyStrengthHaveTheRatioItself) {
  const std::vector<capture::Light> lights{lamp({0.7f, 0.7f, 0.7f}), lamp({3, 3, 3})};
  const CapturedLights rig(lights);
  ASSERT_TRUE(rig.inverseColor());
  EXPECT_EQ(*rig.inverseColor(), (Rgb{1, 1, 1}));
  for (size_t light = 0; light < lights.size(); ++light)
    EXPECT_EQ(rig.inverseStrength(light), rig.ratio({1, 1, 1, 1}, light)[2]);
}

TEST(CapturedLights, LampsOfSeveralColoursHaveNoneInCommon) {
  EXPECT_FALSE(sharedColor(std::vector{lamp({1, 1, 1}), lamp({1, 1, 1.00001f})}).inverse);
  EXPECT_FALSE(sharedColor(std::vector{lamp({1, 2, 3}), bulb({3, 2, 1})}).inverse);
  EXPECT_FALSE(sharedColor({}).inverse);
}

} // namespace
} // namespace surflect::weights
