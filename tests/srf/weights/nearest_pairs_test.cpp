#include "srf/weights/nearest_pairs.h"

#include "srf/weights/pair_weights.h"
#include "tests/srf/shading/queries.h"
#include "tests/support/each_simd.h"
#include "tests/support/random.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

namespace surflect::weights {
namespace {

struct PairKernels : testing::Test {
  std::mt19937 random{5};

  float within(float low, float high) { return std::uniform_real_distribution(low, high)(random); }
  Direction3<AcquisitionSpace> unit() {
    return assume<Direction3<AcquisitionSpace>>(randomUnit(random).cast<float>());
  }

  NearSources sources(size_t count) {
    NearSources all;
    for (uint32_t i = 0; i < count; ++i) all.add(i, unit(), within(0.01f, 1), within(0, 1));
    return all;
  }
};

// Distances of places, by their definition.
TEST_F(PairKernels, PenaltiesAreThoseOfPlaces) {
  const KrigingScales scales;
  for (int round = 0; round < 200; ++round) {
    const NearPairs pairs{sources(1 + random() % kNearSources), sources(1 + random() % kNearSources)};
    const auto& [viewers, lights, _] = pairs;
    const auto light = unit(), view = round % 10 == 0 ? -light : unit();
    const float shadow = within(0, 1);
    std::vector<float> penalties(kNearPairs);
    writePairPenalties(pairs, requestedPair(light, view, shadow, scales), penalties.data());
    const PairPlace asked = pairPlace(light, view, shadow, scales);
    for (size_t v = 0; v < viewers.size; ++v)
      for (size_t l = 0; l < kPairLanes; ++l) {
        const size_t pair = kPairLanes * v + l;
        const float penalty = penalties[pair];
        if (l >= lights.size) {
          EXPECT_EQ(penalty, kInfinity);
          continue;
        }
        PairPlace place = pairs.place(pair, scales);
        const float apart = std::abs(place.back() - asked.back());
        place.back() = asked.back();
        const float squared = squaredDistance(place, asked);
        const auto expected = [&](float distance) {
          return krigingPenalty(distance, apart) / pairs.confidence(pair);
        };
        const bool isNearOpposite = (lights.towards(l).raw() + viewers.towards(v).raw()).norm() < 0.45f;
        const float bound = (isNearOpposite ? 2e-5f : 1e-6f) / (scales.half * scales.half), rounded = 1e-6f;
        EXPECT_GE(penalty, (1 - rounded) * expected(std::max(0.f, squared - bound))) << squared;
        EXPECT_LE(penalty, (1 + rounded) * expected(squared + bound)) << squared;
      }
  }
}

TEST_F(PairKernels, PenaltiesHaveTheSameBitsInEveryInstructionSet) {
  const NearPairs pairs{sources(kNearSources), sources(kNearSources - 1)};
  const RequestedPair asked = requestedPair(unit(), unit(), 0.3f, {});
  const auto penalties = [&] {
    std::vector<float> all(kNearPairs);
    writePairPenalties(pairs, asked, all.data());
    return all;
  };
  const auto first = penalties();
  for ([[maybe_unused]] const Simd simd : EachSimd()) EXPECT_EQ(penalties(), first);
}

TEST_F(PairKernels, ASourceWithoutConfidenceHasNoPairs) {
  NearPairs pairs{sources(2), sources(3)};
  pairs.lights.confidence[1] = 0;
  std::vector<float> penalties(kNearPairs);
  // Met exactly: 0 / 0 would be no number.
  writePairPenalties(
      pairs, requestedPair(pairs.lights.towards(1), pairs.viewers.towards(0), pairs.lights.reached[1], {}),
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

using namespace studio;

// The rig of a model, without photographs of the given views under the given lights.
ReflectanceField withoutPhotographs(const model::Model& model, std::span<const uint32_t> views,
                                    std::span<const uint32_t> lights) {
  ReflectanceField field;
  field.rig = model.rig;
  field.middle = model.middle;
  field.columns = model.columns;
  for (const uint32_t view : views)
    std::erase_if(field.columns[view],
                  [&](uint32_t light) { return std::ranges::find(lights, light) != lights.end(); });
  return field;
}

// Indices of the six directions nearest to the first.
std::vector<uint32_t> nearFirst(const std::vector<Vec3<double>>& towards) {
  std::vector<uint32_t> nearest(towards.size());
  std::iota(nearest.begin(), nearest.end(), 0u);
  std::ranges::sort(nearest, std::greater(), [&](uint32_t i) { return towards[i].dot(towards[0]); });
  nearest.resize(6);
  return nearest;
}

class NearPairsOfRig : public ProductQueries {
protected:
  std::vector<uint32_t> nearViews() const {
    std::vector<Vec3<double>> towards;
    for (const capture::View& view : model.rig.views) towards.push_back(towardsViewer(view, {0, 0, 0}).raw());
    return nearFirst(towards);
  }
  std::vector<uint32_t> nearLights() const {
    std::vector<Vec3<double>> towards;
    for (const capture::Light& light : model.rig.lights)
      towards.push_back(capture::towardsLight(light, {0, 0, 0}).raw());
    return nearFirst(towards);
  }
};

TEST_F(NearPairsOfRig, AreThereInAFullProduct) { EXPECT_TRUE(hasNearPairs(model)); }

TEST_F(NearPairsOfRig, AreThereIfOnePhotographOrOneCameraIsMissing) {
  const std::vector<uint32_t> views = nearViews(), lights = nearLights();
  EXPECT_TRUE(hasNearPairs(withoutPhotographs(model, std::span(views).first(1), std::span(lights).first(1))));
  EXPECT_TRUE(hasNearPairs(withoutPhotographs(model, std::span(views).first(1), lights)));
}

// 9 of 36 near pairs may be missing.
TEST_F(NearPairsOfRig, AreNotThereIfNearViewsLackNearLights) {
  const std::vector<uint32_t> views = nearViews(), lights = nearLights();
  EXPECT_TRUE(hasNearPairs(withoutPhotographs(model, std::span(views).first(3), std::span(lights).first(3))));
  EXPECT_FALSE(
      hasNearPairs(withoutPhotographs(model, std::span(views).first(2), std::span(lights).first(5))));
  EXPECT_FALSE(hasNearPairs(withoutPhotographs(model, views, lights)));
}

TEST(NearPairsOfModels, ComeWithPackingAndOpening) {
  const PackedStudio few(nearlyFullStudio(), 200), many(gappyStudio(), 200);
  EXPECT_FALSE(few.model.isFullProduct);
  EXPECT_TRUE(few.model.hasNearPairs);
  EXPECT_FALSE(many.model.hasNearPairs);
}

} // namespace
} // namespace surflect::weights
