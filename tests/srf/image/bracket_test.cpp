#include "srf/image/bracket.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace surflect::image {

namespace {

Response squares() {
  Response response;
  for (size_t c = 0; c < 3; ++c)
    for (size_t z = 0; z < Response::codes; ++z)
      response.exposure[c][z] = static_cast<float>((c + 1) * z * z);
  return response;
}

TEST(Response, CodesGiveTheirExposure) {
  const Response response = squares();
  for (size_t c = 0; c < 3; ++c)
    for (size_t z = 0; z < Response::codes; ++z)
      EXPECT_NEAR(response(c, static_cast<float>(z) / 255), response.exposure[c][z],
                  1e-4f * static_cast<float>((c + 1) * (1 + z)));
}

TEST(Response, BetweenCodesItIsLinearAndBeyondThemItEnds) {
  const Response response = squares();
  EXPECT_NEAR(response(0, 10.5f / 255), 110.5f, 1e-3f);
  EXPECT_EQ(response(1, 2), response(1, 1));
  EXPECT_EQ(response(1, -1), 0);
  EXPECT_TRUE(std::isnan(response(1, NAN)));
}

} // namespace

namespace {

// A linear camera that clips at 1.
ExposureSample shot(float radiance, float seconds) {
  const float z = std::min(radiance * seconds, 1.f);
  return {z, z, seconds};
}

TEST(Bracket, HatIsZeroAtBothEndsAndPeaksInTheMiddle) {
  EXPECT_EQ(hatWeight(0, 0, 8), 0);
  EXPECT_EQ(hatWeight(8, 0, 8), 0);
  EXPECT_EQ(hatWeight(4, 0, 8), 4);
  for (const float z : {-1.f, 9.f}) EXPECT_EQ(hatWeight(z, 0, 8), 0);
  for (float d = 0; d <= 4; d += 0.25f) EXPECT_EQ(hatWeight(4 - d, 0, 8), hatWeight(4 + d, 0, 8));
}

TEST(Bracket, ExactSamplesGiveTheRadianceWhateverTheExposures) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> logarithm(-6, 6), slight(-1, 1);
  for (int i = 0; i < 1000; ++i) {
    const float radiance = std::exp(logarithm(random));
    std::vector<ExposureSample> samples{shot(radiance, 0.5f / radiance)}; // one at least is not clipped
    for (int k = 0; k < 5; ++k) samples.push_back(shot(radiance, std::exp(slight(random)) / radiance));
    EXPECT_NEAR(mergedRadiance(samples, 1), radiance, 1e-6f * radiance);
  }
}

TEST(Bracket, OrderDoesNotMatterButForRounding) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> value(0, 1);
  for (int i = 0; i < 100; ++i) {
    std::vector<ExposureSample> samples;
    for (int k = 0; k < 4; ++k) samples.push_back({value(random), value(random), 0.1f + value(random)});
    const float before = mergedRadiance(samples, 1);
    std::reverse(samples.begin(), samples.end());
    EXPECT_NEAR(mergedRadiance(samples, 1), before, 1e-5f * before);
  }
}

TEST(Bracket, ClippedInAllIsTheShortestBlackInAllTheLongest) {
  const ExposureSample clipped[] = {shot(100, 1), shot(100, 0.25f), shot(100, 4)};
  EXPECT_EQ(mergedRadiance(clipped, 1), 4);
  const ExposureSample black[] = {{0, 0.001f, 1}, {0, 0.001f, 0.25f}, {-0.5f, -0.5f, 4}};
  EXPECT_EQ(mergedRadiance(black, 1), -0.125f);
  const ExposureSample between[] = {{1, 1, 100}, {0, 0.001f, 1}}; // black is nearer than clipped
  EXPECT_EQ(mergedRadiance(between, 1), 0.001f);
}

TEST(Bracket, SamplesThatAreNotThereDoNotCount) {
  ExposureSample samples[] = {shot(0.5f, 1), {NAN, 7, 1}};
  EXPECT_EQ(mergedRadiance(samples, 1), 0.5f);
  samples[0].z = NAN;
  EXPECT_TRUE(std::isnan(mergedRadiance(samples, 1)));
}

} // namespace

} // namespace surflect::image
