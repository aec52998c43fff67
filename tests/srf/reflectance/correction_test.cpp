#include "srf/reflectance/correction.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <random>
#include <vector>

namespace surflect::reflectance {
namespace {

constexpr float kUnit = 0.3f; // of a white pixel

struct Scene {
  PredictedReflectance query;
  std::vector<PredictedReflectance> photographs;
  std::vector<float> weights;
  std::vector<Rgb> shown; // X_i

  Rgb answer() const {
    std::vector<float> factors = weights;
    Rgb answer = applyCorrection(query, photographs, kUnit, factors);
    for (size_t i = 0; i < factors.size(); ++i) answer = answer + factors[i] * shown[i];
    return answer;
  }
};

Scene randomScene(std::mt19937& random) {
  std::uniform_real_distribution<float> value(0, 1);
  const auto color = [&] {
    const float r = value(random), g = value(random), b = value(random);
    return Rgb{r, g, b};
  };
  Scene scene{{color(), value(random)}, {}, {}, {}};
  for (int i = 0; i < 6; ++i) {
    scene.photographs.push_back({color(), value(random)});
    scene.weights.push_back(value(random) / 6);
    scene.shown.push_back(color());
  }
  return scene;
}

void expectNear(const Rgb& a, const Rgb& b, float tolerance) {
  EXPECT_NEAR(a.r, b.r, tolerance);
  EXPECT_NEAR(a.g, b.g, tolerance);
  EXPECT_NEAR(a.b, b.b, tolerance);
}

TEST(Correction, IsTheWeightedMeanOfRelativeErrors) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const Scene scene = randomScene(random);
    const float scale = errorScale(scene.query.value, scene.query.cosine, kUnit);
    double sum = 0;
    for (size_t i = 0; i < scene.weights.size(); ++i)
      sum += scene.weights[i] * (scene.shown[i].g - scene.photographs[i].value.g) *
             std::min(kMostScaled,
                      scale / errorScale(scene.photographs[i].value, scene.photographs[i].cosine, kUnit));
    EXPECT_NEAR(scene.answer().g, scene.query.value.g + sum, 3e-7);
  }
}

// What one photograph shows in the dark, of whatever strength, stays below four times that in a highlight.
TEST(Correction, AResidualInTheDarkDoesNotSparkle) {
  const PredictedReflectance highlight{{30, 30, 30}, 1};
  for (const float beside : {0.1f, 0.5f, 3.f}) {
    const PredictedReflectance dark{{0, 0, 0}, 0.05f};
    std::array<float, 1> weight{1};
    const Rgb offset = applyCorrection(highlight, {&dark, 1}, kUnit, weight);
    EXPECT_LE(offset.g + weight[0] * beside, 30 + kMostScaled * beside);
  }
}

TEST(Correction, AnswersWithThePhotographThatIsMet) {
  std::mt19937 random(2);
  Scene scene = randomScene(random);
  scene.weights.assign(6, 0);
  scene.weights[2] = 1;
  scene.query = scene.photographs[2];
  expectNear(scene.answer(), scene.shown[2], 1e-6f);
}

TEST(Correction, AnswersWithTheTableWherePhotographsAgreeWithItOrHaveNoWeight) {
  std::mt19937 random(3);
  Scene scene = randomScene(random);
  for (size_t i = 0; i < scene.shown.size(); ++i) scene.shown[i] = scene.photographs[i].value;
  expectNear(scene.answer(), scene.query.value, 1e-5f);
  Scene far = randomScene(random);
  far.weights.assign(6, 0);
  EXPECT_EQ(far.answer(), far.query.value);
}

// A surfel that is brighter than its table by one factor everywhere.
TEST(Correction, ScalesABrightTableAsItsPhotographsDo) {
  std::mt19937 random(4);
  Scene scene = randomScene(random);
  for (PredictedReflectance& each : scene.photographs) each.value = 100.f * Rgb{1, 1, 1};
  scene.query.value = {40, 40, 40};
  for (size_t i = 0; i < scene.shown.size(); ++i) scene.shown[i] = 1.2f * scene.photographs[i].value;
  const float sum = std::accumulate(scene.weights.begin(), scene.weights.end(), 0.f);
  for (float& weight : scene.weights) weight /= sum;
  expectNear(scene.answer(), 1.2f * scene.query.value, 0.01f);
}

TEST(Correction, OfABlackTableIsFinite) {
  const Scene scene{{{0, 0, 0}, 0}, {{{0, 0, 0}, 0}}, {1}, {{0.5f, 0, 0}}};
  expectNear(scene.answer(), {0.5f, 0, 0}, 1e-6f);
}

} // namespace
} // namespace surflect::reflectance
