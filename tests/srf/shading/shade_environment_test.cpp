#include "srf/shading/shade.h"

#include "srf/weights/light_weights.h"
#include "tests/srf/shading/queries.h"
#include "tests/support/random.h"
#include "tests/support/synthetic_capture.h"

#include <tbb/task_arena.h>

namespace surflect::shading {
namespace {

using studio::gappyStudio;
using studio::PackedStudio;
using studio::Studio;
using ToAcquisition = Rotation<AcquisitionSpace, EnvironmentSpace, float>;

constexpr size_t cacheBudget = size_t{1} << 30; // cache budget in bytes

// A random orthogonal matrix, possibly mirroring.
ToAcquisition randomTurn(std::mt19937& random) {
  const Vec3<float> a = randomUnit<float>(random), b = randomUnit<float>(random).cross(a).normalized();
  Mat3<float> matrix;
  matrix << a, b, (random() % 2 ? a : Vec3<float>(-a)).cross(b);
  return ToAcquisition(matrix);
}

std::vector<weights::EnvironmentLight> randomEnvironment(size_t count, std::mt19937& random) {
  std::uniform_real_distribution<float> strength(0.1f, 2);
  std::vector<weights::EnvironmentLight> lights;
  for (size_t i = 0; i < count; ++i) {
    const float r = strength(random), g = strength(random), b = strength(random);
    lights.push_back({assume<Direction3<EnvironmentSpace>>(randomUnit<float>(random)), {r, g, b}});
  }
  return lights;
}

// Random surfels and viewers outside the surface, without lights.
weights::QueryBatch darkBatch(const model::Model& model, size_t queries, std::mt19937& random) {
  weights::QueryBatch batch;
  for (size_t q = 0; q < queries; ++q) {
    const auto surfel = static_cast<uint32_t>(random() % model.cloud.size());
    batch.surfels.push_back(surfel);
    Vec3<float> towards = randomUnit<float>(random);
    if (towards.dot(model.cloud.p0[surfel].raw()) < 0) towards = -towards;
    batch.towardsView.push_back(assume<Direction3<AcquisitionSpace>>(towards));
  }
  return batch;
}

// Adds an environment with a random rotation for each query.
void addTurnedEnvironment(weights::QueryBatch& batch, const weights::QueryEnvironment& environment,
                          std::mt19937& random) {
  ASSERT_TRUE(batch.environments.empty());
  batch.environments.push_back(environment);
  for (size_t q = 0; q < batch.size(); ++q) batch.acquisitionFromEnvironment.push_back(randomTurn(random));
}

// Replaces environments by their directional lights.
weights::QueryBatch unrolled(const weights::QueryBatch& batch) {
  weights::QueryBatch result = batch;
  result.environments.clear();
  result.acquisitionFromEnvironment.clear();
  const weights::QueryEnvironment& environment = batch.environments[0];
  result.lights = environment.lights.size();
  result.extrapolation.assign(result.lights, environment.extrapolation);
  for (size_t q = 0; q < batch.size(); ++q)
    for (const auto& light : environment.lights) {
      result.towardsLight.push_back(batch.acquisitionFromEnvironment[q](light.towards));
      result.irradiance.push_back(environment.strength * light.irradiance);
    }
  return result;
}

std::vector<Rgb> shadedWith(const model::Model& model, const weights::QueryBatch& batch,
                            const weights::ShadeOptions& options = {}) {
  codec::BlockCache cache(model.files, cacheBudget);
  ShadingStats stats;
  return shade(model, batch, options, cache, stats).radiance;
}

// Captured irradiance that a plan requests, per query.
std::vector<Rgb> irradianceOf(const model::Model& model, const weights::QueryBatch& batch,
                              const ShadingPlan& plan) {
  std::vector<Rgb> sums(plan.places);
  for (const ShadingOp& op : plan.ops)
    for (const auto& [column, weight] : studio::rowOf(plan, op)) {
      const auto& light = model.rig.lights[model.columns[op.view][column]];
      const size_t query = op.target / plan.targetsPerPlace;
      const Rgb captured = capture::irradianceAt(light, model.cloud.p0[batch.surfels[query]].cast<double>());
      Rgb& sum = sums[query];
      sum = sum + op.weight * (weight * captured);
    }
  return sums;
}

double largestDifference(std::span<const Rgb> a, std::span<const Rgb> b) {
  EXPECT_EQ(a.size(), b.size());
  double largest = 0;
  for (size_t i = 0; i < a.size(); ++i)
    for (const float d : {a[i].r - b[i].r, a[i].g - b[i].g, a[i].b - b[i].b})
      largest = std::max(largest, double{std::abs(d)});
  return largest;
}

double largest(std::span<const Rgb> values) {
  return largestDifference(values, std::vector<Rgb>(values.size()));
}

// Each property is tested for full products under lights of different strengths, and for captures with gaps.
class ShadeEnvironment : public ::testing::TestWithParam<bool> {
protected:
  static void SetUpTestSuite() {
    full = std::make_unique<PackedStudio>(Studio{.unevenness = 0.5}, 1500);
    gappy = std::make_unique<PackedStudio>(gappyStudio(), 1000);
  }
  static void TearDownTestSuite() {
    full.reset();
    gappy.reset();
  }

  static inline std::unique_ptr<PackedStudio> full, gappy;
  ShadeEnvironment() {
    model.interpolation.kind = weights::Interpolation::separate;
  } // as environments are weighted

  model::Model model = model::openModel((GetParam() ? full : gappy)->model.folder);
  std::mt19937 random{1};
};
INSTANTIATE_TEST_SUITE_P(, ShadeEnvironment, testing::Bool(),
                         [](const auto& capture) { return capture.param ? "FullProduct" : "Pairs"; });

TEST_P(ShadeEnvironment, IsTheSumOfItsDirectionalLights) {
  const auto lights = randomEnvironment(9, random);
  weights::QueryBatch batch = darkBatch(model, 300, random);
  addTurnedEnvironment(batch, {lights, {0.5f, 1, 2}, weights::LightExtrapolation::clamp, nullptr}, random);
  const auto together = shadedWith(model, batch), apart = shadedWith(model, unrolled(batch));
  EXPECT_LT(largestDifference(together, apart) / largest(apart), 1.5e-6);
}

TEST_P(ShadeEnvironment, OneTexelIsItsDirectionalLightForeshortenedOrNot) {
  const auto lights = randomEnvironment(1, random);
  std::vector<Rgb> answers[2]; // plain and foreshortened; pairs do not depend on it
  const weights::QueryBatch dark = darkBatch(model, 2000, random);
  for (const bool foreshortened : {false, true}) {
    if (foreshortened && !GetParam()) continue;
    const weights::ShadeOptions options{.foreshortened = foreshortened};
    const auto table = lightTable(model, options, weights::LightExtrapolation::clamp);
    for (const bool tabulated : {false, true}) {
      if (tabulated && !table) continue;
      std::mt19937 turns(7);
      weights::QueryBatch batch = dark;
      addTurnedEnvironment(
          batch, {lights, {0.5f, 1, 2}, weights::LightExtrapolation::clamp, tabulated ? &*table : nullptr},
          turns);
      const auto got = shadedWith(model, batch, options),
                 wanted = shadedWith(model, unrolled(batch), options);
      EXPECT_LT(largestDifference(got, wanted) / largest(wanted), tabulated ? 0.02 : 4e-7);
      double sum = 0;
      for (size_t q = 0; q < got.size(); ++q) sum += std::abs(got[q].g - wanted[q].g);
      // A table smooths the creases of the blend, as below.
      EXPECT_LT(sum / static_cast<double>(got.size()) / largest(wanted), tabulated ? 2e-4 : 1e-7);
      answers[foreshortened] = got;
    }
  }
  if (GetParam()) {
    EXPECT_GT(largestDifference(answers[0], answers[1]), 0.01 * largest(answers[0]));
  }
}

TEST_P(ShadeEnvironment, OneWithoutLightShowsAsNothing) {
  weights::QueryBatch batch = darkBatch(model, 100, random);
  addTurnedEnvironment(batch, {{}, {1, 1, 1}, weights::LightExtrapolation::fade, nullptr}, random);
  EXPECT_EQ(shadedWith(model, batch), std::vector<Rgb>(batch.size()));
  for (const Rgb& color : planShading(model, batch, {.showsBlends = true}).lightBlend)
    EXPECT_EQ(color, Rgb{});
}

TEST_P(ShadeEnvironment, AMeanKeepsTheIrradiance) {
  const auto lights = randomEnvironment(40, random);
  const Rgb total = weights::totalIrradiance(lights);
  const weights::ShadeOptions mean{.lightFit = weights::LightFit::mean, .foreshortened = false};
  const auto table = lightTable(model, mean, weights::LightExtrapolation::clamp);
  EXPECT_EQ(table.has_value(), GetParam());
  for (const weights::LightTable* used :
       {static_cast<const weights::LightTable*>(nullptr), table ? &*table : nullptr}) {
    weights::QueryBatch batch = darkBatch(model, 300, random);
    addTurnedEnvironment(batch, {lights, {1, 1, 1}, weights::LightExtrapolation::clamp, used}, random);
    const ShadingPlan plan = planShading(model, batch, mean);
    for (const Rgb& sum : irradianceOf(model, batch, plan)) {
      EXPECT_NEAR(sum.r / total.r, 1, 3e-6);
      EXPECT_NEAR(sum.g / total.g, 1, 3e-6);
      EXPECT_NEAR(sum.b / total.b, 1, 3e-6);
    }
  }
}

TEST_P(ShadeEnvironment, EnvironmentsAndLightsAddUp) {
  const auto first = randomEnvironment(5, random), second = randomEnvironment(8, random);
  weights::QueryBatch a = darkBatch(model, 300, random), both, b, lamp;
  b = lamp = a;
  addTurnedEnvironment(a, {first}, random);
  addTurnedEnvironment(b, {second}, random);
  lamp.lights = 1;
  for (size_t q = 0; q < lamp.size(); ++q) {
    lamp.towardsLight.push_back(assume<Direction3<AcquisitionSpace>>(randomUnit<float>(random)));
    lamp.irradiance.push_back({1, 2, 0.5f});
  }
  both = lamp;
  both.environments = {a.environments[0], b.environments[0]};
  for (size_t q = 0; q < both.size(); ++q)
    for (const weights::QueryBatch* one : {&a, &b})
      both.acquisitionFromEnvironment.push_back(one->acquisitionFromEnvironment[q]);
  const auto sum = shadedWith(model, both), ofA = shadedWith(model, a), ofB = shadedWith(model, b),
             ofLamp = shadedWith(model, lamp);
  std::vector<Rgb> added;
  for (size_t q = 0; q < sum.size(); ++q) added.push_back(ofA[q] + ofB[q] + ofLamp[q]);
  EXPECT_LT(largestDifference(sum, added) / largest(sum), 1e-6);
}

TEST_P(ShadeEnvironment, TurningTheMapAndItsFrameAgainstEachOtherChangesNothing) {
  const auto lights = randomEnvironment(6, random);
  weights::QueryBatch batch = darkBatch(model, 200, random);
  addTurnedEnvironment(batch, {lights}, random);
  const Mat3<float> turn = randomTurn(random).matrix();
  auto turned = lights;
  for (auto& light : turned) light.towards = assume<Direction3<EnvironmentSpace>>(turn * light.towards.raw());
  weights::QueryBatch other = batch;
  other.environments[0].lights = turned;
  for (auto& acquisitionFromEnvironment : other.acquisitionFromEnvironment)
    acquisitionFromEnvironment = ToAcquisition(acquisitionFromEnvironment.matrix() * turn.transpose());
  const auto expected = shadedWith(model, batch);
  // Loose, since ULR weights are steep.
  EXPECT_LT(largestDifference(shadedWith(model, other), expected) / largest(expected), 2e-4);
}

TEST_P(ShadeEnvironment, ADarkEnvironmentIsBlackAndChangesNoOther) {
  const auto lights = randomEnvironment(6, random);
  weights::QueryBatch batch = darkBatch(model, 200, random);
  addTurnedEnvironment(batch, {lights, {0, 0, 0}}, random);
  EXPECT_EQ(shadedWith(model, batch), std::vector<Rgb>(batch.size()));
  batch.environments[0].lights = {};
  EXPECT_EQ(shadedWith(model, batch), std::vector<Rgb>(batch.size()));
}

TEST_P(ShadeEnvironment, BlendColorsAreMeansAndSumAsThoseOfItsLights) {
  const auto lights = randomEnvironment(1, random); // lights differ in strength, and hence in share
  weights::QueryBatch batch = darkBatch(model, 200, random);
  addTurnedEnvironment(batch, {lights, {3, 3, 3}, weights::LightExtrapolation::clamp, nullptr}, random);
  const ShadingPlan one = planShading(model, batch, {.showsBlends = true}),
                    other = planShading(model, unrolled(batch), {.showsBlends = true});
  EXPECT_LT(largestDifference(one.lightBlend, other.lightBlend), 1e-6);
  EXPECT_LT(largestDifference(one.cameraBlend, other.cameraBlend), 1e-6);
}

// Blend colours show which lights are blended, which foreshortening does not change.
TEST_P(ShadeEnvironment, BlendColorsAreNotForeshortened) {
  if (!GetParam()) return; // pairs are never foreshortened
  const auto lights = randomEnvironment(20, random);
  weights::ShadeOptions off{.lightFit = weights::LightFit::mean, .foreshortened = false, .showsBlends = true},
      on = off;
  on.foreshortened = true;
  // One table for both: a mean has the same weights with and without foreshortening.
  const auto table = lightTable(model, off, weights::LightExtrapolation::fade);
  for (const weights::LightTable* used : {static_cast<const weights::LightTable*>(nullptr), &*table}) {
    weights::QueryBatch batch = darkBatch(model, 200, random);
    addTurnedEnvironment(batch, {lights, {1, 1, 1}, weights::LightExtrapolation::fade, used}, random);
    const ShadingPlan plain = planShading(model, batch, off), scaled = planShading(model, batch, on);
    EXPECT_GT(largestDifference(irradianceOf(model, batch, plain), irradianceOf(model, batch, scaled)), 0.1);
    EXPECT_LT(largestDifference(plain.lightBlend, scaled.lightBlend), 1e-7);
  }
}

TEST_P(ShadeEnvironment, SameBitsForAnyThreads) {
  const auto lights = randomEnvironment(20, random);
  const auto table = lightTable(model, {}, weights::LightExtrapolation::fade);
  weights::QueryBatch batch = darkBatch(model, 1500, random);
  addTurnedEnvironment(
      batch, {lights, {1, 1, 1}, weights::LightExtrapolation::fade, table ? &*table : nullptr}, random);
  const auto expected = shadedWith(model, batch);
  for (const int threads : {1, 2})
    tbb::task_arena(threads).execute([&] { EXPECT_EQ(shadedWith(model, batch), expected); });
}

// Captured lights only above; environments and lights of every kind.
TEST_P(ShadeEnvironment, WhatIsFarFromCapturedLightsFadesAndTheRestStays) {
  Studio studio = GetParam() ? Studio{.unevenness = 0.5} : gappyStudio();
  const auto split = studio.split;
  studio.lights = 60;
  studio.split = [split](size_t view, size_t light) {
    return light < 30 ? split(view, light) : std::nullopt;
  };
  const PackedStudio dome(studio, 600);
  ASSERT_EQ(dome.model.isFullProduct, GetParam());
  const double spacing = lightSpacing(dome.model);
  ASSERT_LT(spacing, 0.7);

  weights::QueryBatch batch = darkBatch(dome.model, 400, random);
  batch.lights = 1;
  for (size_t q = 0; q < batch.size(); ++q) {
    batch.towardsLight.push_back(assume<Direction3<AcquisitionSpace>>(randomUnit<float>(random)));
    batch.irradiance.push_back({1, 1, 1});
  }
  const weights::ShadeOptions plain{.lightFit = weights::LightFit::mean, .foreshortened = false};
  const auto extrapolated = irradianceOf(dome.model, batch, planShading(dome.model, batch, plain));
  batch.extrapolation = {weights::LightExtrapolation::fade};
  const auto faded = irradianceOf(dome.model, batch, planShading(dome.model, batch, plain));
  size_t inside = 0, outside = 0;
  for (size_t q = 0; q < batch.size(); ++q) {
    const double elevation = std::asin(double{batch.towardsLight[q].y()}); // studio lights spiral around y
    EXPECT_NEAR(extrapolated[q].g, 1, 2e-6);
    if (elevation > 0.1) {
      ++inside;
      EXPECT_EQ(faded[q].g, extrapolated[q].g);
    }
    if (elevation < -2 * spacing) {
      ++outside;
      EXPECT_EQ(faded[q].g, 0);
    }
  }
  EXPECT_GT(inside, 100u);
  EXPECT_GT(outside, 10u);

  // An environment of the same light fades as the light does.
  for (const bool tabulated : {false, true}) {
    const auto table = lightTable(dome.model, plain, weights::LightExtrapolation::fade);
    if (tabulated && !table) continue;
    weights::QueryBatch maps = batch;
    maps.lights = 0;
    maps.towardsLight.clear();
    maps.irradiance.clear();
    maps.extrapolation.clear();
    const weights::EnvironmentLight lamp{{0, 0, 1}, {1, 1, 1}};
    maps.environments.push_back(
        {{&lamp, 1}, {1, 1, 1}, weights::LightExtrapolation::fade, tabulated ? &*table : nullptr});
    for (const auto& towards : batch.towardsLight)
      maps.acquisitionFromEnvironment.emplace_back(turnFromZ(towards.raw()));
    const auto got = irradianceOf(dome.model, maps, planShading(dome.model, maps, plain));
    // A table smooths the creases where the nearest light changes. The steepest slope of the coverage, 1.6 /
    // spacing per radian, gives 0.02 over half a cell, 2 / 175 on the square and up to sqrt(6) times that on
    // the sphere (measured: 0.027).
    double mean = 0;
    for (size_t q = 0; q < batch.size(); ++q) {
      EXPECT_NEAR(got[q].g, faded[q].g, tabulated ? 0.03 : 2e-6);
      mean += std::abs(got[q].g - faded[q].g) / static_cast<double>(batch.size());
    }
    EXPECT_LT(mean, 0.001);
  }
}

TEST_P(ShadeEnvironment, TheNearestLightAnswersForItInTheBaseline) {
  const auto lights = randomEnvironment(7, random);
  weights::ShadeOptions nearest;
  nearest.nearest = true;
  weights::QueryBatch batch = darkBatch(model, 200, random);
  addTurnedEnvironment(batch, {lights, {1, 1, 1}, weights::LightExtrapolation::fade, nullptr}, random);
  const auto together = shadedWith(model, batch, nearest),
             apart = shadedWith(model, unrolled(batch), nearest);
  EXPECT_LT(largestDifference(together, apart) / largest(apart), 2e-6);
}

TEST(ShadeEnvironmentFixed, FixedIlluminationRefusesEnvironments) {
  const PackedStudio packed({.lights = 0}, 300);
  std::mt19937 random(3);
  const auto lights = randomEnvironment(2, random);
  weights::QueryBatch batch = darkBatch(packed.model, 5, random);
  addTurnedEnvironment(batch, {lights}, random);
  EXPECT_NE(image::errorOf([&] { planShading(packed.model, batch, {}); }).find("fixed illumination"),
            std::string::npos);
}

} // namespace
} // namespace surflect::shading
