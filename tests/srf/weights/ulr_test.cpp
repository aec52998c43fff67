#include "srf/weights/ulr.h"

#include "srf/weights/nearest_sources.h"
#include "tests/support/each_simd.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <vector>

namespace surflect::weights {
namespace {

using Direction = Direction3<AcquisitionSpace>;

Direction randomDirection(std::mt19937_64& random) {
  std::normal_distribution<float> normal;
  return assume<Direction>(Vec3<float>(normal(random), normal(random), normal(random)).normalized());
}

std::vector<Direction> randomRig(size_t count, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Direction> rig;
  while (rig.size() < count) rig.push_back(randomDirection(random));
  return rig;
}

BlendSet blendOf(std::span<const float> penalties, size_t k) {
  NearestCandidates nearest(k);
  for (uint32_t i = 0; i < penalties.size(); ++i) nearest.offer({i, penalties[i]});
  return ulrWeights(nearest);
}

BlendSet blendOf(const std::vector<Direction>& rig, const Direction& query, size_t k) {
  std::vector<float> penalties;
  for (const auto& d : rig) penalties.push_back(anglePenalty(d, query));
  return blendOf(penalties, k);
}

TEST(Ulr, WeightsArePositiveAndSumToOne) {
  std::mt19937_64 random(1);
  for (const size_t candidates : {1u, 2u, 3u, 5u, 40u})
    for (const size_t k : {1u, 3u, 4u, 16u})
      for (int i = 0; i < 200; ++i) {
        const auto blend = blendOf(randomRig(candidates, random()), randomDirection(random), k);
        ASSERT_GE(blend.size(), 1u);
        ASSERT_LE(blend.size(), std::min(k, candidates));
        float sum = 0;
        for (const auto& [index, weight] : blend) {
          EXPECT_GT(weight, 0);
          sum += weight;
        }
        EXPECT_NEAR(sum, 1, 1e-6);
      }
}

TEST(Ulr, AQueryAlongACamerasOwnRayGetsThatCameraAlone) {
  const auto rig = randomRig(40, 2);
  for (uint32_t i = 0; i < rig.size(); ++i)
    for (const auto& [index, weight] : blendOf(rig, rig[i], 4)) EXPECT_NEAR(weight, index == i ? 1 : 0, 1e-6);
}

TEST(Ulr, MatchesAPlainSortInDoublePrecision) {
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 500; ++trial) {
    const auto rig = randomRig(40, random());
    const auto query = randomDirection(random);
    constexpr size_t k = 4;
    std::vector<std::pair<double, uint32_t>> sorted;
    for (uint32_t i = 0; i < rig.size(); ++i)
      sorted.emplace_back((rig[i].raw().cast<double>() - query.raw().cast<double>()).squaredNorm() / 2, i);
    std::ranges::sort(sorted);
    std::map<uint32_t, double> expected;
    double sum = 0;
    for (size_t i = 0; i < k; ++i)
      sum += expected[sorted[i].second] =
          std::max(0.0, (1 - sorted[i].first / std::min(1.0, sorted[k].first))) / sorted[i].first;
    for (const auto& [index, weight] : blendOf(rig, query, k))
      EXPECT_NEAR(weight, expected[index] / sum, 2e-5);
  }
}

TEST(Ulr, EqualPenaltiesGetEqualShares) {
  for (const float p : {0.f, 0.2f, 1.f, 1.7f}) {
    const std::vector<float> penalties(5, p);
    const auto blend = blendOf(penalties, 4);
    ASSERT_EQ(blend.size(), 4u);
    for (uint32_t i = 0; i < 4; ++i) {
      EXPECT_EQ(blend[i].index, i); // ties by index
      EXPECT_FLOAT_EQ(blend[i].weight, 0.25f);
    }
  }
}

TEST(Ulr, ACandidateBeyondNinetyDegreesCountsOnlyWhenNoneIsWithinSixty) {
  const auto near = blendOf(std::vector<float>{1.2f, 0.49f, 1.01f}, 4);
  ASSERT_EQ(near.size(), 1u);
  EXPECT_EQ(near[0].index, 1u);
  const auto far = blendOf(std::vector<float>{0.9f, 1.81f, 1.5f}, 4);
  ASSERT_EQ(far.size(), 2u); // candidates below 2 * 0.9
  EXPECT_EQ(far[0].index, 0u);
  EXPECT_EQ(far[1].index, 2u);
}

TEST(Ulr, BeyondNinetyDegreesWeightsDependOnTheRatioOfPenalties) {
  const auto once = blendOf(std::vector<float>{1.f, 1.3f, 1.9f}, 4),
             thrice = blendOf(std::vector<float>{3.f, 3.9f, 5.7f}, 4);
  ASSERT_EQ(once.size(), 3u);
  ASSERT_EQ(thrice.size(), 3u);
  for (size_t i = 0; i < 3; ++i) EXPECT_FLOAT_EQ(once[i].weight, thrice[i].weight);
}

TEST(Ulr, HiddenCandidatesAreNeverChosen) {
  const float hidden = std::numeric_limits<float>::infinity();
  const auto blend = blendOf(std::vector<float>{hidden, 0.5f, hidden, std::nanf("")}, 4);
  ASSERT_EQ(blend.size(), 1u);
  EXPECT_EQ(blend[0].index, 1u);
  EXPECT_TRUE(blendOf(std::vector<float>{hidden, hidden}, 4).empty());
}

// Largest change of any weight between neighbouring steps of a path over penalties.
template <class PenaltiesAt> double largestJump(const PenaltiesAt& penaltiesAt, size_t steps, size_t k) {
  double largest = 0;
  std::map<uint32_t, float> before;
  for (size_t i = 0; i <= steps; ++i) {
    std::map<uint32_t, float> now;
    const std::vector<float> penalties = penaltiesAt(static_cast<double>(i) / static_cast<double>(steps));
    for (const auto& [index, weight] : blendOf(penalties, k)) now[index] = weight;
    if (i > 0) {
      for (const auto& [index, weight] : now)
        largest = std::max(largest, std::abs(static_cast<double>(weight - before[index])));
      for (const auto& [index, weight] : before)
        largest = std::max(largest, std::abs(static_cast<double>(weight - now[index])));
    }
    before = std::move(now);
  }
  return largest;
}

// Small enough to come near the theoretical limit, yet resolved in single precision.
constexpr size_t kSteps = 32000;

TEST(Ulr, HalvingTheStepHalvesTheLargestChangeAlongAGreatCircle) {
  std::mt19937_64 random(4);
  for (const size_t lights : {3u, 5u, 28u, 60u})
    for (int trial = 0; trial < 4; ++trial) {
      const auto rig = randomRig(lights, random());
      const Vec3<float> a = randomDirection(random).raw(), b = a.unitOrthogonal();
      const auto path = [&](double s) {
        const auto angle = static_cast<float>(6.2831853 * s);
        const auto query = assume<Direction>(a * std::cos(angle) + b * std::sin(angle));
        std::vector<float> penalties;
        for (const auto& d : rig) penalties.push_back(anglePenalty(d, query));
        return penalties;
      };
      EXPECT_LE(largestJump(path, 2 * kSteps, 4), 0.55 * largestJump(path, kSteps, 4)) << lights << " lights";
    }
}

TEST(Ulr, ACameraThatFadesOutLeavesWithoutAJump) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<float> uniform(0.02f, 0.6f);
  for (const size_t cameras : {1u, 2u, 4u, 5u, 12u})
    for (int trial = 0; trial < 10; ++trial) {
      std::vector<float> rest;
      for (size_t i = 0; i < cameras; ++i) rest.push_back(uniform(random));
      const auto path = [&](double s) { // all cameras fade in turn, except the last
        std::vector<float> penalties = rest;
        for (size_t i = 0; i + 1 < cameras; ++i) {
          const double x =
              std::clamp(1 - (s * static_cast<double>(cameras) - static_cast<double>(i)), 0.0, 1.0);
          penalties[i] /= static_cast<float>(x * x * (3 - 2 * x));
        }
        return penalties;
      };
      EXPECT_LE(largestJump(path, 2 * kSteps, 4), 0.55 * largestJump(path, kSteps, 4) + 1e-5)
          << cameras << " cameras";
    }
}

TEST(Ulr, ConfidenceFallsWithThePenaltyAndIsNeverNothing) {
  EXPECT_EQ(confidenceOf(0), 1);
  EXPECT_EQ(confidenceOf(1), 1 / 16.f);
  float before = 1;
  for (float penalty = 0.01f; penalty < 30; penalty *= 1.3f) {
    EXPECT_LT(confidenceOf(penalty), before);
    before = confidenceOf(penalty);
  }
  EXPECT_GT(confidenceOf(std::numeric_limits<float>::infinity()), 1e-6f);
}

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
      const BlendSet kept = truncated(blend, error);
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
  constexpr int kFadeSteps = 2000;
  constexpr size_t kCount = 5;
  for (int run = 0; run < 20; ++run) {
    const BlendSet from = randomBlend(kCount, random), to = randomBlend(kCount, random);
    for (const float error : kErrors) {
      std::vector<float> before;
      for (int step = 0; step <= kFadeSteps; ++step) {
        const float t = static_cast<float>(step) / kFadeSteps;
        BlendSet blend = from;
        for (size_t i = 0; i < kCount; ++i) blend[i].weight += t * (to[i].weight - from[i].weight);
        const std::vector<float> now = denseWeights(truncated(blend, error), kCount);
        for (size_t i = 0; i < kCount && step > 0; ++i) EXPECT_NEAR(now[i], before[i], 20.f / kFadeSteps);
        before = now;
      }
    }
  }
}

TEST(WeightTruncation, KeepsTheSumAndTheOrderOfWeights) {
  std::mt19937 random(3);
  for (int run = 0; run < 1000; ++run) {
    const BlendSet blend = randomBlend(6, random);
    EXPECT_EQ(denseWeights(truncated(blend, 0), 6), denseWeights(blend, 6));
    const std::vector<float> before = denseWeights(blend, 6), after = denseWeights(truncated(blend, 0.2f), 6);
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
        NearestLights whole(lights), shortened(lights, error);
        QueryBlends plain, lanes;
        whole.setPlaces(places);
        whole.blend(towards, count, plain);
        shortened.setPlaces(places);
        shortened.blend(towards, count, lanes);
        for (size_t lane = 0; lane < kQueryLanes; ++lane) {
          const std::vector<float> wanted = denseWeights(truncated(plain.of(lane), error), lights.size()),
                                   got = denseWeights(lanes.of(lane), lights.size());
          for (size_t i = 0; i < lights.size(); ++i) EXPECT_NEAR(got[i], wanted[i], 1e-5f) << nameOf(simd);
        }
      }
}

} // namespace
} // namespace surflect::weights
