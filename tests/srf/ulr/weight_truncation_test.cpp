#include "srf/ulr/weight_truncation.h"

#include "srf/ulr/nearest_sources.h"
#include "tests/support/each_simd.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace surflect::ulr {
namespace {

constexpr float kErrors[] = {0.02f, 0.1f, 0.2f, 0.5f};

// Random weights that sum to 1, of very different sizes.
BlendSet randomBlend(size_t count, std::mt19937& random) {
  std::uniform_real_distribution<float> power(-3, 0);
  BlendSet blend;
  float sum = 0;
  for (uint32_t i = 0; i < count; ++i) {
    blend.push({i, std::pow(10.f, power(random))});
    sum += blend[i].weight;
  }
  for (Blended& blended : blend) blended.weight /= sum;
  return blend;
}

BlendSet truncatedBy(BlendSet blend, float error) {
  truncate(blend, error);
  return blend;
}

// Weight of each of `count` sources.
std::vector<float> denseWeights(const BlendSet& blend, size_t count) {
  std::vector<float> weights(count);
  for (const auto& [index, weight] : blend) weights[index] = weight;
  return weights;
}

TEST(WeightTruncation, ChangesAMeanByAtMostTheErrorTimesTheSpreadOfTheValues) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> number(-1, 1);
  size_t dropped = 0;
  float largest = 0; // change, relative to the bound
  for (int run = 0; run < 20000; ++run) {
    const size_t count = 2 + random() % (kMaxBlended - 1);
    const BlendSet blend = randomBlend(count, random);
    for (const float error : kErrors) {
      const BlendSet kept = truncatedBy(blend, error);
      ASSERT_GT(kept.size(), 0u);
      dropped += count - kept.size();
      std::vector<float> values;
      for (size_t i = 0; i < count; ++i) values.push_back(number(random));
      if (random() % 2 == 0) // the worst case: what is dropped differs most from what is kept
        for (const auto& [index, weight] : kept) values[index] = 2;
      const auto meanOf = [&](const BlendSet& of) {
        float mean = 0;
        for (const auto& [index, weight] : of) mean += weight * values[index];
        return mean;
      };
      const auto [least, most] = std::ranges::minmax(values);
      const float change = std::abs(meanOf(kept) - meanOf(blend));
      EXPECT_LE(change, error * (most - least) + 1e-6f);
      largest = std::max(largest, change / (error * (most - least)));
    }
  }
  EXPECT_GT(dropped, 100'000u);
  EXPECT_GT(largest, 0.5f);
}

// Weights move along random lines, on which sources change places; none jumps.
TEST(WeightTruncation, IsContinuousInTheWeights) {
  std::mt19937 random(2);
  constexpr int kSteps = 2000;
  constexpr size_t kCount = 5;
  for (int run = 0; run < 20; ++run) {
    const BlendSet from = randomBlend(kCount, random), to = randomBlend(kCount, random);
    for (const float error : kErrors) {
      std::vector<float> before;
      for (int step = 0; step <= kSteps; ++step) {
        const float t = static_cast<float>(step) / kSteps;
        BlendSet blend = from;
        for (size_t i = 0; i < kCount; ++i) blend[i].weight += t * (to[i].weight - from[i].weight);
        const std::vector<float> now = denseWeights(truncatedBy(blend, error), kCount);
        for (size_t i = 0; i < kCount && step > 0; ++i) EXPECT_NEAR(now[i], before[i], 20.f / kSteps);
        before = now;
      }
    }
  }
}

TEST(WeightTruncation, KeepsTheSumAndTheOrderOfWeights) {
  std::mt19937 random(3);
  for (int run = 0; run < 1000; ++run) {
    const BlendSet blend = randomBlend(6, random);
    EXPECT_EQ(denseWeights(truncatedBy(blend, 0), 6), denseWeights(blend, 6));
    const std::vector<float> before = denseWeights(blend, 6),
                             after = denseWeights(truncatedBy(blend, 0.2f), 6);
    float sum = 0;
    for (size_t i = 0; i < 6; ++i) {
      sum += after[i];
      for (size_t j = 0; j < 6; ++j)
        if (before[i] <= before[j]) {
          EXPECT_LE(after[i], after[j]);
        }
    }
    EXPECT_NEAR(sum, 1, 1e-6);
  }
}

TEST(WeightTruncation, LanesEqualThePlainForm) {
  std::mt19937 random(5);
  std::vector<Source> lights;
  for (int i = 0; i < 60; ++i) lights.push_back({randomUnit(random), true});
  std::vector<Point3<AcquisitionSpace>> places(kQueryLanes);
  std::vector<Direction3<AcquisitionSpace>> towards;
  for (size_t lane = 0; lane < kQueryLanes; ++lane)
    towards.push_back(assume<Direction3<AcquisitionSpace>>(randomUnit<float>(random)));
  for (const Simd simd : EachSimd())
    for (const float error : kErrors)
      for (const size_t count : {1, 3, 4, 16}) {
        NearestLights whole(lights), truncated(lights, error);
        QueryBlends plain, lanes;
        whole.setPlaces(places);
        whole.blend(towards, count, plain);
        truncated.setPlaces(places);
        truncated.blend(towards, count, lanes);
        for (size_t lane = 0; lane < kQueryLanes; ++lane) {
          const std::vector<float> wanted = denseWeights(truncatedBy(plain.of(lane), error), lights.size()),
                                   got = denseWeights(lanes.of(lane), lights.size());
          for (size_t i = 0; i < lights.size(); ++i) EXPECT_NEAR(got[i], wanted[i], 1e-5f) << nameOf(simd);
        }
      }
}

} // namespace
} // namespace surflect::ulr
