#include "srf/model/weights_selection.h"

#include "srf/proxy/relief/photometric.h"
#include "srf/weights/irradiance_ratio.h"
#include "tests/srf/shading/queries.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace surflect::model {

namespace {

using Direction = Direction3<AcquisitionSpace>;

// Lights spread over a spherical cap; the upper half lies above z = 0.5.
std::vector<Direction> lightsOfACap(int count) {
  std::vector<Direction> lights;
  for (int i = 0; i < count; ++i) {
    const float z = 1 - 0.5f * (static_cast<float>(i) + 0.5f) / static_cast<float>(count);
    const float r = std::sqrt(1 - z * z), turn = 2.399963f * static_cast<float>(i);
    lights.push_back(assume<Direction>(Vec3<float>(r * std::cos(turn), r * std::sin(turn), z).normalized()));
  }
  return lights;
}

using Shading = std::function<float(const Vec3<float>& normal, const Vec3<float>& light)>;

Normal3<AcquisitionSpace> asNormal(const Vec3<float>& n) { return assume<Normal3<AcquisitionSpace>>(n); }

// Selection for texels with upward normals, under lights of different strengths. `known` maps true normals to
// those given to the selection.
LightBlendSelection choiceFor(
    const Shading& shading, int lights, float scale = 1,
    const std::function<Vec3<float>(const Vec3<float>&)>& known = [](const Vec3<float>& n) { return n; },
    NormalsFrom from = NormalsFrom::shape) {
  const auto towards = lightsOfACap(lights);
  std::vector<Rgb> irradiance;
  for (int i = 0; i < lights; ++i) irradiance.push_back(static_cast<float>(1 + i % 3) * Rgb{1, 1.5f, 0.5f});
  ReflectanceSamples samples(towards, irradiance);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-0.3f, 0.3f);
  for (int texel = 0; texel < 500; ++texel) {
    const float x = uniform(random), y = uniform(random);
    const Vec3<float> normal = Vec3<float>(x, y, 1).normalized();
    std::vector<Rgb> reflectance;
    for (size_t i = 0; i < towards.size(); ++i)
      reflectance.push_back(scale * shading(normal, towards[i].raw()) * Rgb{1, 1, 1});
    samples.add(reflectance, asNormal(known(normal)));
  }
  return samples.choose(5 * scale, from);
}

float matte(const Vec3<float>& normal, const Vec3<float>& light) { return std::max(0.f, normal.dot(light)); }

// A lobe around the normal, much narrower than the spacing of lights.
float glossy(const Vec3<float>& normal, const Vec3<float>& light) {
  return 5 * std::exp(300 * (normal.dot(light) - 1));
}

TEST(LightBlendSelection, AMatteSurfaceIsForeshortened) {
  const auto [blend, leftOutDb] = choiceFor(matte, 20);
  EXPECT_EQ(blend, (weights::LightBlend{3, weights::LightFit::mean, true}));
  EXPECT_GT(*leftOutDb, 60); // exact except for the residual
}

TEST(LightBlendSelection, AMatteSurfaceOfWrongNormalsIsBlendedByAPlane) {
  const auto aside = [](const Vec3<float>&) { return Vec3<float>(1, 0, 0); };
  const auto [blend, leftOutDb] = choiceFor(matte, 20, 1, aside);
  EXPECT_FALSE(blend.foreshortened);
  EXPECT_EQ(blend.fit, weights::LightFit::plane);
  // Radiance is linear in the direction. Without the omitted light the spacing is s = 0.45 radians. A mean is
  // off by s / 2, of which the ridge leaves 0.1 / (1/2 + 0.1).
  EXPECT_GT(*leftOutDb, -20 * std::log10(0.45 / 2 / 6));
}

TEST(LightBlendSelection, HighlightsAreBlendedByAFewLightsMean) {
  EXPECT_EQ(choiceFor(glossy, 20).blend, (weights::LightBlend{3, weights::LightFit::mean}));
}

TEST(LightBlendSelection, WhatLooksAlikeUnderAllLightsNeedsTheLeast) {
  const auto [blend, leftOutDb] = choiceFor([](const auto&, const auto&) { return 0.5f; }, 20);
  EXPECT_EQ(blend, (weights::LightBlend{3, weights::LightFit::mean}));
  EXPECT_GT(*leftOutDb, 100);
}

// Photometric normals of a matte surface replace whatever normals are given.
TEST(LightBlendSelection, NormalsThatPhotographsTellForeshortenAPlane) {
  const auto aside = [](const Vec3<float>&) { return Vec3<float>(1, 0, 0); };
  const auto [blend, leftOutDb] = choiceFor(matte, 20, 1, aside, NormalsFrom::photographs);
  EXPECT_EQ(blend, (weights::LightBlend{4, weights::LightFit::plane, true}));
  EXPECT_GT(*leftOutDb, 60);
}

// Noise differs between lights: normals that were also fitted to the omitted light would follow its noise,
// and promise more than new lights deliver.
TEST(LightBlendSelection, NormalsAreNotToldByTheLightLeftOut) {
  constexpr int lights = 7;
  const auto towards = lightsOfACap(lights);
  ReflectanceSamples samples(towards, std::vector<Rgb>(lights, Rgb{1, 1, 1}));
  std::vector<Vec3<double>> directions;
  for (const auto& light : towards) directions.push_back(light.raw().cast<double>());
  std::mt19937 random(4);
  std::normal_distribution<float> noise(0, 0.1f);
  std::uniform_real_distribution<float> turn(0, 6.2831853f);
  for (int texel = 0; texel < 3000; ++texel) {
    const float a = turn(random);
    const Vec3<float> normal = Vec3<float>(std::cos(a), std::sin(a), 0.7f).normalized();
    std::vector<Rgb> radiance;
    for (const auto& light : towards) {
      const float value = std::max(0.f, matte(normal, light.raw()) + noise(random));
      radiance.push_back({value, value, value});
    }
    std::vector<Rgb> shares;
    for (const Rgb& value : radiance) shares.push_back(std::numbers::pi_v<float> * value);
    samples.add(radiance, asNormal(relief::fitLambert(directions, shares).normal.cast<float>()));
  }
  const auto told = samples.choose(1, NormalsFrom::photographs),
             given = samples.choose(1, NormalsFrom::shape);
  EXPECT_TRUE(told.blend.foreshortened);
  EXPECT_TRUE(given.blend.foreshortened);
  EXPECT_LT(*told.leftOutDb, *given.leftOutDb - 1.2);
}

TEST(LightBlendSelection, WhereNothingTellsNormalsNothingIsForeshortened) {
  const auto same = [](const Vec3<float>& n) { return n; };
  EXPECT_EQ(choiceFor(matte, 20, 1, same, NormalsFrom::nothing).blend.fit, weights::LightFit::plane);
  EXPECT_FALSE(choiceFor(matte, 20, 1, same, NormalsFrom::nothing).blend.foreshortened);
}

// Among six lights all around, a surface can face one squarely while turned away from all others.
TEST(LightBlendSelection, LightsFarApartAreNotForeshortened) {
  std::vector<Direction> axes;
  for (int i = 0; i < 6; ++i) {
    Vec3<float> axis = Vec3<float>::Zero();
    axis[i / 2] = i % 2 == 0 ? 1.f : -1.f;
    axes.push_back(assume<Direction>(axis));
  }
  ReflectanceSamples samples(axes, std::vector<Rgb>(6, Rgb{1, 1, 1}));
  std::mt19937 random(2);
  std::normal_distribution<float> normal;
  for (int texel = 0; texel < 500; ++texel) {
    const float x = normal(random), y = normal(random), z = normal(random);
    const Vec3<float> n = Vec3<float>(x, y, z).normalized();
    std::vector<Rgb> radiance;
    for (const auto& light : axes) radiance.push_back(matte(n, light.raw()) * Rgb{1, 1, 1});
    samples.add(radiance, assume<Normal3<AcquisitionSpace>>(n));
  }
  EXPECT_FALSE(samples.choose(1, NormalsFrom::shape).blend.foreshortened);
}

TEST(LightBlendSelection, TooFewLightsTellNothing) {
  EXPECT_EQ(choiceFor(matte, 4).blend, weights::LightBlend());
  EXPECT_FALSE(choiceFor(matte, 4).leftOutDb);
  EXPECT_TRUE(choiceFor(matte, 5).leftOutDb);
  EXPECT_LE(choiceFor(matte, 5).blend.lights, 3u);
}

TEST(LightBlendSelection, TheUnitOfRadianceDoesNotMatter) {
  const auto one = choiceFor(matte, 12), thousand = choiceFor(matte, 12, 1000);
  EXPECT_EQ(one.blend, thousand.blend);
  EXPECT_NEAR(*one.leftOutDb, *thousand.leftOutDb, 1e-3);
}

TEST(LightBlendSelection, StopsWhenAsked) {
  ReflectanceSamples samples(lightsOfACap(5), std::vector<Rgb>(5, Rgb{1, 1, 1}));
  samples.add(std::vector<Rgb>(5), asNormal({0, 0, 1}));
  Progress progress;
  progress.cancelled = [] { return true; };
  EXPECT_THROW(samples.choose(1, NormalsFrom::shape, progress), Cancelled);
}

// The error computed by hand: five lights, weights of the same blend, one texel.
TEST(LightBlendSelection, TheErrorIsThatOfTheLightsLeftOut) {
  const auto towards = lightsOfACap(5);
  const std::vector<Rgb> irradiance(5, Rgb{1, 1, 1});
  const float radiance[] = {0.2f, 0.9f, 0.4f, 0.1f, 0.6f};
  ReflectanceSamples samples(towards, irradiance);
  std::vector<Rgb> texel;
  for (const float value : radiance) texel.push_back({value, value, value});
  samples.add(texel, asNormal({0.6f, 0, 0.8f}));
  const auto [blend, leftOutDb] = samples.choose(1, NormalsFrom::shape);
  double squares = 0;
  for (size_t out = 0; out < 5; ++out) {
    std::vector<Direction> others;
    std::vector<Direction3<AcquisitionSpace, double>> covering;
    std::vector<double> values;
    for (size_t i = 0; i < 5; ++i)
      if (i != out) {
        others.push_back(towards[i]);
        covering.push_back(towards[i].cast<double>());
        values.push_back(radiance[i]);
      }
    double got = 0;
    const weights::BlendSet weights =
        weights::blendOfLights(others, towards[out], blend, weights::LightExtrapolationFade(covering),
                               weights::LightExtrapolation::clamp);
    for (const auto& [light, weight] : weights) got += weight * values[light];
    if (blend.foreshortened) {
      const auto normal = asNormal({0.6f, 0, 0.8f});
      std::vector<float> cosines;
      for (const auto& other : others) cosines.push_back(weights::foreshortenedCosine(normal, other));
      got *= weights::foreshortening(weights::foreshortenedCosine(normal, towards[out]),
                                     weights::blendedCosine(weights, cosines));
    }
    const auto shown = [](double x) {
      x = std::clamp(x, 0.0, 1.0);
      return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
    };
    squares += std::pow(shown(got) - shown(radiance[out]), 2);
  }
  EXPECT_NEAR(*leftOutDb, -10 * std::log10(squares / 5), 1e-3);
}

} // namespace

namespace {

using namespace studio;

TEST(InterpolationSelection, HighlightsAreWeightedByPairs) {
  const PackedStudio packed(Studio{.cameras = 30, .gloss = 1});
  const auto& [choice, foreshortened, trust, leftOut] = packed.report.interpolation;
  EXPECT_EQ(choice.kind, weights::Interpolation::kriging);
  EXPECT_LE(choice.halfScale, 0.4f);
  ASSERT_TRUE(leftOut);
  EXPECT_GT(leftOut->chosenDb, leftOut->separateDb + 1);
  EXPECT_EQ(packed.model.interpolation, choice);
  EXPECT_TRUE(foreshortened);
}

// A matte sphere, whose foreshortened photographs are exact under any weights.
TEST(InterpolationSelection, AMatteSphereKeepsSeparateWeights) {
  const PackedStudio packed(Studio{});
  const auto& [choice, foreshortened, trust, leftOut] = packed.report.interpolation;
  EXPECT_EQ(choice.kind, weights::Interpolation::separate);
  EXPECT_TRUE(foreshortened);
  ASSERT_TRUE(leftOut);
  EXPECT_EQ(leftOut->chosenDb, leftOut->separateDb);
  EXPECT_GT(leftOut->separateDb, 30);
}

// Many surfels have seen the highlight of a sphere under all angles.
TEST(InterpolationSelection, HighlightsOfOneKindOfSurfaceAreAnsweredByTables) {
  const PackedStudio& packed = tableStudio();
  const auto& [choice, foreshortened, trust, leftOut] = packed.report.interpolation;
  EXPECT_EQ(choice.kind, weights::Interpolation::shared);
  EXPECT_EQ(packed.model.interpolation, choice);
  ASSERT_TRUE(packed.model.shared);
  EXPECT_EQ(packed.model.shared->trust, trust);
  EXPECT_EQ(packed.model.shared->gains.size(), packed.model.cloud.size());
  ASSERT_TRUE(leftOut);
  EXPECT_GT(leftOut->chosenDb, leftOut->separateDb + 3);
}

// Single photographs are left out of a capture with gaps.
TEST(InterpolationSelection, ACaptureWithGapsIsWeightedByPairsToo) {
  Studio studio = gappyStudio();
  studio.cameras = 30;
  studio.gloss = 1;
  const PackedStudio packed(studio, 500);
  const auto& [choice, foreshortened, trust, leftOut] = packed.report.interpolation;
  EXPECT_FALSE(packed.model.isFullProduct);
  EXPECT_EQ(choice.kind, weights::Interpolation::kriging);
  ASSERT_TRUE(leftOut);
  EXPECT_GT(leftOut->chosenDb, leftOut->separateDb + 1);
  EXPECT_EQ(packed.model.lightBlend.foreshortened, foreshortened);
}

TEST(InterpolationSelection, TooFewCamerasOrLightsAreWeightedApart) {
  for (const Studio& few : {Studio{.cameras = 3}, Studio{.lights = 3}, Studio{.lights = 0}}) {
    const PackedStudio packed(few, 500);
    EXPECT_EQ(packed.report.interpolation.choice, weights::InterpolationChoice{});
    EXPECT_FALSE(packed.report.interpolation.leftOut);
  }
}

} // namespace

} // namespace surflect::model
