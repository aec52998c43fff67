#include "srf/ulr/foreshortening.h"

#include "tests/srf/ulr/lights.h"

#include <gtest/gtest.h>

namespace surflect::ulr {
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

} // namespace
} // namespace surflect::ulr
