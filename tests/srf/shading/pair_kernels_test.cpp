#include "srf/shading/pair_kernels.h"

#include "srf/shading/pair_weights.h"
#include "tests/support/each_simd.h"
#include "tests/support/random.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

namespace surflect::shading {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

struct PairKernels : testing::Test {
  std::mt19937 random{5};

  float within(float low, float high) { return std::uniform_real_distribution(low, high)(random); }
  Vec3<float> unit() { return randomUnit(random).cast<float>(); }

  NearSources sources(size_t count) {
    NearSources all;
    for (uint32_t i = 0; i < count; ++i) all.add(i, unit(), within(0.01f, 1), within(0, 1));
    return all;
  }
};

Direction3<AcquisitionSpace> direction(const Vec3<float>& v) {
  return assume<Direction3<AcquisitionSpace>>(v);
}

RequestedPair requested(const Vec3<float>& light, const Vec3<float>& view, float shadow,
                        const ulr::KrigingScales& scales, bool isKriging) {
  const Vec3<float> half = ulr::halfVector(light, view);
  return {{light[0], light[1], light[2]},
          {view[0], view[1], view[2]},
          {half[0], half[1], half[2]},
          shadow,
          1 / (scales.half * scales.half),
          1 / (scales.light * scales.light),
          1 / (scales.view * scales.view),
          1 / scales.shadow,
          isKriging};
}

// Distances of places, by their definition.
TEST_F(PairKernels, PenaltiesAreThoseOfPlaces) {
  const ulr::KrigingScales scales;
  for (int round = 0; round < 200; ++round) {
    const NearSources viewers = sources(1 + random() % kNearSources),
                      lights = sources(1 + random() % kNearSources);
    const Vec3<float> light = unit(), view = round % 10 == 0 ? Vec3<float>(-light) : unit();
    const float shadow = within(0, 1);
    const bool isKriging = round % 2 == 0;
    std::vector<float> penalties(kNearPairs);
    writePairPenalties(viewers, lights, requested(light, view, shadow, scales, isKriging), penalties.data());
    const ulr::PairPlace asked = ulr::pairPlace(direction(light), direction(view), shadow, scales);
    for (size_t v = 0; v < viewers.size; ++v)
      for (size_t l = 0; l < kPairLanes; ++l) {
        const float penalty = penalties[kPairLanes * v + l];
        if (l >= lights.size) {
          EXPECT_EQ(penalty, kInfinity);
          continue;
        }
        ulr::PairPlace place = ulr::pairPlace(direction(lights.towards(l)), direction(viewers.towards(v)),
                                              lights.reached[l], scales);
        const float apart = std::abs(place.back() - asked.back());
        place.back() = asked.back();
        const float squared = ulr::squaredDistance(place, asked);
        const float trust = viewers.confidence[v] * lights.confidence[l];
        const auto expected = [&](float distance) {
          return (isKriging ? krigingPenalty(distance, apart) : pairPenalty(distance, apart)) / trust;
        };
        const bool isNearOpposite = (lights.towards(l) + viewers.towards(v)).norm() < 0.45f;
        const float bound = (isNearOpposite ? 2e-5f : 1e-6f) / (scales.half * scales.half), rounded = 1e-6f;
        EXPECT_GE(penalty, (1 - rounded) * expected(std::max(0.f, squared - bound))) << squared;
        EXPECT_LE(penalty, (1 + rounded) * expected(squared + bound)) << squared;
      }
  }
}

TEST_F(PairKernels, PenaltiesHaveTheSameBitsInEveryInstructionSet) {
  const NearSources viewers = sources(kNearSources), lights = sources(kNearSources - 1);
  const RequestedPair asked = requested(unit(), unit(), 0.3f, {}, true);
  const auto penalties = [&] {
    std::vector<float> all(kNearPairs);
    writePairPenalties(viewers, lights, asked, all.data());
    return all;
  };
  const auto first = penalties();
  for ([[maybe_unused]] const Simd simd : EachSimd()) EXPECT_EQ(penalties(), first);
}

TEST_F(PairKernels, ASourceWithoutConfidenceHasNoPairs) {
  NearSources viewers = sources(2), lights = sources(3);
  lights.confidence[1] = 0;
  std::vector<float> penalties(kNearPairs);
  // Met exactly: 0 / 0 would be no number.
  writePairPenalties(viewers, lights,
                     requested(lights.towards(1), viewers.towards(0), lights.reached[1], {}, false),
                     penalties.data());
  EXPECT_EQ(penalties[1], kInfinity);
  EXPECT_LT(penalties[2], kInfinity);
}

TEST_F(PairKernels, TheLeastComeInOrderAndTiesAsTheyStand) {
  for ([[maybe_unused]] const Simd simd : EachSimd())
    for (int round = 0; round < 300; ++round) {
      std::vector<float> penalties(kPairLanes * (1 + random() % 12));
      for (float& penalty : penalties) {
        penalty = static_cast<float>(random() % 20); // ties are frequent
        if (penalty == 19) penalty = kInfinity;
        if (penalty == 18) penalty = std::numeric_limits<float>::quiet_NaN();
      }
      std::vector<uint32_t> order(penalties.size());
      std::iota(order.begin(), order.end(), 0);
      std::erase_if(order, [&](uint32_t i) { return !(penalties[i] < kInfinity); });
      std::ranges::stable_sort(order, {}, [&](uint32_t i) { return penalties[i]; });
      const size_t most = 1 + random() % 17;
      order.resize(std::min(order.size(), most));
      std::vector<float> values;
      for (const uint32_t i : order) values.push_back(penalties[i]);

      std::vector<uint32_t> places(most);
      std::vector<float> least(most);
      const size_t found = findLeast(penalties.data(), penalties.size(), most, places.data(), least.data());
      places.resize(found), least.resize(found);
      EXPECT_EQ(places, order);
      EXPECT_EQ(least, values);
    }
}

} // namespace
} // namespace surflect::shading
