#include "render/surfels/predicted_error.h"

#include "srf/weights/ulr.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace surflect::surfels {
namespace {

constexpr int sampleWidth = 12, sampleHeight = 9;

image::Image filled(int channels, float value) {
  image::Image image(sampleWidth, sampleHeight, channels);
  std::ranges::fill(image.values, value);
  return image;
}

image::Image randomImage(int channels, uint32_t seed) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  image::Image image(sampleWidth, sampleHeight, channels);
  for (float& value : image.values) value = uniform(rng);
  return image;
}

image::Image scaled(image::Image image, float factor) {
  for (float& value : image.values) value *= factor;
  return image;
}

image::Image brighter(image::Image image, float offset) {
  for (float& value : image.values) value += offset;
  return image;
}

TEST(PredictedError, AnEvenPictureWhosePhotographsAgreeWhereCamerasAreHasNone) {
  const image::Image color = filled(4, 0.7f);
  for (const float error : predictedError(color, color, filled(1, 0), {}).values) EXPECT_LT(error, 1e-7);
}

TEST(PredictedError, IsTheDifferenceFromTheNearestPhotographTimesItsCoefficient) {
  const image::Image color = filled(4, 0.5f);
  for (const float error : predictedError(color, brighter(color, 0.25f), filled(1, 1), {4, 1, 0}).values)
    EXPECT_NEAR(error, 2 * 0.25, 1e-6);
}

// A ramp of slope s has the variance 2/3 s^2 over three columns, and 1/4 s^2 over two at the border.
TEST(PredictedError, OfARampIsItsSlopeTimesTheRootOfTwoThirds) {
  constexpr float slope = 0.125f;
  image::Image ramp(sampleWidth, sampleHeight, 4);
  for (int y = 0; y < sampleHeight; ++y)
    for (int x = 0; x < sampleWidth; ++x)
      for (size_t c = 0; c < 3; ++c) ramp.at(x, y)[c] = slope * static_cast<float>(x);
  const image::Image error = predictedError(ramp, ramp, filled(1, 0), {1, 1, 1});
  for (int y = 0; y < sampleHeight; ++y)
    for (int x = 0; x < sampleWidth; ++x)
      EXPECT_NEAR(error.at(x, y)[0], slope * std::sqrt(x == 0 || x == sampleWidth - 1 ? 0.25 : 2 / 3.), 1e-6);
}

TEST(PredictedError, OfAViewGapIsAShareOfTheColor) {
  const image::Image color = filled(4, 0.5f);
  for (const float error : predictedError(color, color, filled(1, 0.25f), {1, 1, 0.64}).values)
    EXPECT_NEAR(error, 0.8 * 0.5 * 0.5, 1e-6);
}

TEST(PredictedError, ScalesWithThePicture) {
  const image::Image color = randomImage(4, 1), nearest = randomImage(4, 2), gap = randomImage(1, 3);
  const image::Image once = predictedError(color, nearest, gap, {}),
                     fourfold = predictedError(scaled(color, 4), scaled(nearest, 4), gap, {});
  for (size_t i = 0; i < once.values.size(); ++i)
    EXPECT_NEAR(fourfold.values[i], 4 * once.values[i], 1e-6 * fourfold.values[i]);
}

TEST(PredictedError, AddsTheVariancesOfItsTerms) {
  const image::Image color = randomImage(4, 1), nearest = randomImage(4, 2), gap = randomImage(1, 3);
  const auto errorWith = [&](const ErrorModel& model) { return predictedError(color, nearest, gap, model); };
  const image::Image all = errorWith({1, 2, 3}), a = errorWith({1, 0, 0}), b = errorWith({0, 2, 0}),
                     g = errorWith({0, 0, 3});
  for (size_t i = 0; i < all.values.size(); ++i) {
    EXPECT_NEAR(all.values[i], std::hypot(a.values[i], b.values[i], g.values[i]), 1e-6);
    EXPECT_GE(all.values[i], std::max({a.values[i], b.values[i], g.values[i]}));
  }
}

TEST(PredictedError, ReusesMemoryOfAnySize) {
  const image::Image color = randomImage(4, 1), gap = randomImage(1, 3);
  const image::Image fresh = predictedError(color, color, gap, {});
  const image::Image reused = predictedError(color, color, gap, {}, randomImage(4, 5));
  EXPECT_EQ(reused.channels, 1);
  EXPECT_EQ(reused.values, fresh.values);
}

// weights::confidenceOf limits penalties to 30.
TEST(PredictedError, TheViewGapIsTheBestPenaltyUpToOne) {
  std::vector<float> penalties{0, 0.001f, 0.1f, 0.5f, 1, 2, 29, 1000}, confidence;
  for (const float penalty : penalties) confidence.push_back(weights::confidenceOf(penalty));
  const std::vector<float> gaps = viewGaps(confidence);
  for (size_t i = 0; i < penalties.size(); ++i) EXPECT_NEAR(gaps[i], std::min(1.f, penalties[i]), 1e-6) << i;
}

} // namespace
} // namespace surflect::surfels
