#include "srf/weights/nearest_sources.h"

#include "surfel/math/simd.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>

namespace surflect::weights {
namespace {

using Direction = Direction3<AcquisitionSpace>;
using Place = Point3<AcquisitionSpace>;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

struct Query {
  Place place;
  Direction towards;
  uint32_t surfel = 0;
};

// Direction to a source in double precision, as the planner's reference computes it.
Direction towards(const Source& source, const Place& place) {
  const Vec3<double> to = source.isDistant
                              ? source.place
                              : Vec3<double>((source.place - place.raw().cast<double>()).normalized());
  return assume<Direction>(to.cast<float>());
}

double penaltyOf(const Source& source, const Query& query, const VisibilityWeights* visibility,
                 size_t index) {
  const double penalty = anglePenalty(towards(source, query.place), query.towards);
  if (!visibility) return penalty;
  const uint8_t fade = visibility->of(query.surfel)[index];
  return fade == 0 ? std::numeric_limits<double>::infinity() : penalty / VisibilityWeights::decode(fade);
}

NearestCandidates rated(std::span<const Source> sources, const Query& query,
                        const VisibilityWeights* visibility, size_t k) {
  NearestCandidates nearest(k);
  for (uint32_t i = 0; i < sources.size(); ++i)
    nearest.offer({i, static_cast<float>(penaltyOf(sources[i], query, visibility, i))});
  return nearest;
}

std::map<uint32_t, float> weightsOf(const BlendSet& blend) {
  std::map<uint32_t, float> weights;
  for (const auto& [index, weight] : blend) weights[index] = weight;
  return weights;
}

bool areSame(const BlendSet& a, const BlendSet& b) {
  return std::ranges::equal(
      a, b, [](const Blended& x, const Blended& y) { return x.index == y.index && x.weight == y.weight; });
}

class NearestSources : public ::testing::TestWithParam<Simd> {
protected:
  NearestSources() { useSimd(GetParam()); }
  ~NearestSources() override { useSimd(supportedSimd().back()); }

  Vec3<double> randomVector() {
    const double x = normal_(random), y = normal_(random), z = normal_(random);
    return {x, y, z};
  }
  Direction randomDirection() { return assume<Direction>(randomVector().normalized().cast<float>()); }
  Place randomPlace(double reach) { return assume<Place>((reach * randomVector()).cast<float>()); }
  std::vector<Source> randomSources(size_t count, double distantShare) {
    std::vector<Source> sources;
    for (size_t i = 0; i < count; ++i) {
      const Vec3<double> at = randomVector().normalized();
      const bool isDistant = std::uniform_real_distribution()(random) < distantShare;
      sources.push_back({isDistant ? at : Vec3<double>(4 * at), isDistant});
    }
    return sources;
  }
  // Rows of fades for as many surfels as a group has queries.
  VisibilityWeights randomFades(size_t views, double share) {
    VisibilityWeights visibility{views, std::vector<uint8_t>(views * kQueryLanes)};
    for (auto& fade : visibility.values)
      if (std::uniform_real_distribution()(random) < share) fade = static_cast<uint8_t>(1 + random() % 255);
    return visibility;
  }
  // Queries close together, along a curve, or anywhere, depending on `spread`.
  std::vector<Query> randomGroup(size_t count, double spread) {
    const Place middle = randomPlace(0.4);
    const Direction direction = randomDirection();
    std::vector<Query> group;
    for (uint32_t i = 0; i < count; ++i) {
      const Vec3<double> at = middle.raw().cast<double>() + spread * randomVector(),
                         to = direction.raw().cast<double>() + spread * randomVector();
      group.push_back({assume<Place>(at.cast<float>()), assume<Direction>(to.normalized().cast<float>()), i});
    }
    return group;
  }

  // `blends` holds the result of the previous group, if any.
  QueryBlends blendLights(NearestLights& lanes, std::span<const Query> group, size_t k,
                          QueryBlends blends = {}) {
    std::vector<Place> places;
    std::vector<Direction> directions;
    for (const Query& query : group) places.push_back(query.place), directions.push_back(query.towards);
    lanes.setPlaces(places);
    lanes.blend(directions, k, blends);
    return blends;
  }
  QueryBlends blendViews(NearestViews& lanes, std::span<const Query> group, size_t k) {
    std::vector<uint32_t> surfels;
    std::vector<Place> places;
    std::vector<Direction> directions;
    for (const Query& query : group) {
      surfels.push_back(query.surfel);
      places.push_back(query.place);
      directions.push_back(query.towards);
    }
    return lanes.blend(surfels, places, directions, k);
  }

  std::mt19937_64 random{1};

private:
  std::normal_distribution<double> normal_;
};

// The chosen sources must be the k nearest in double precision, except for ties within rounding.
void expectNearest(const BlendSet& got, std::span<const Source> sources, const Query& query,
                   const VisibilityWeights* visibility, size_t k) {
  constexpr double u = 0x1p-24;
  const auto nearest = rated(sources, query, visibility, k);
  const auto wanted = weightsOf(ulrWeights(nearest));
  const auto rounding = [&](uint32_t i) { // rounding of a penalty, in both precisions
    const double fade = visibility ? VisibilityWeights::decode(visibility->of(query.surfel)[i]) : 1;
    const double angle = fade * penaltyOf(sources[i], query, visibility, i);
    return (10 * u * std::sqrt(2 * angle) + 100 * u * u + 10 * u * angle) / fade;
  };
  if (nearest.sorted().empty()) {
    EXPECT_TRUE(got.empty());
    return;
  }
  const Candidate last = nearest.sorted()[std::min(k, nearest.sorted().size()) - 1];
  for (const auto& [i, weight] : got) {
    EXPECT_GT(weight, 0);
    EXPECT_LE(penaltyOf(sources[i], query, visibility, i), last.penalty + rounding(i) + rounding(last.index));
  }
  const auto weights = weightsOf(got);
  EXPECT_EQ(weights.size(), got.size());
  float sum = 0;
  for (const auto& [i, weight] : weights) {
    sum += weight;
    const auto other = wanted.find(i);
    EXPECT_NEAR(weight, other == wanted.end() ? 0 : other->second, 1e-5);
  }
  for (const auto& [i, weight] : wanted) EXPECT_NEAR(weight, weights.contains(i) ? weights.at(i) : 0, 1e-5);
  EXPECT_NEAR(sum, 1, 5e-7);
}

TEST_P(NearestSources, LightsAreBlendedAsInDoublePrecision) {
  for (const size_t count : {1, 2, 5, 16, 17, 60, 432})
    for (const double distant : {0.0, 0.5, 1.0}) {
      const auto lights = randomSources(count, distant);
      NearestLights lanes(lights);
      for (const size_t k : {1, 3, 4, 8, 16})
        for (const double spread : {0.01, 1.0}) {
          const auto group = randomGroup(1 + random() % kQueryLanes, spread);
          const QueryBlends blends = blendLights(lanes, group, k);
          for (size_t i = 0; i < group.size(); ++i) {
            ASSERT_TRUE(blends.isPrecise(i));
            expectNearest(blends.of(i), lights, group[i], nullptr, k);
          }
        }
    }
}

TEST_P(NearestSources, ViewsAreBlendedAsInDoublePrecision) {
  for (const size_t count : {1, 2, 5, 16, 17, 60, 432})
    for (const double distant : {0.0, 0.5})
      for (const double share : {1.0, 0.4, 0.03, 0.0}) {
        const auto views = randomSources(count, distant);
        const VisibilityWeights visibility = randomFades(count, share);
        NearestViews lanes(views, visibility);
        for (const size_t k : {1, 4, 16})
          // Each begins with the views of the previous one.
          for (const double spread : {0.01, 0.02, 0.1, 1.0}) {
            const auto group = randomGroup(1 + random() % kQueryLanes, spread);
            const QueryBlends blends = blendViews(lanes, group, k);
            for (size_t i = 0; i < group.size(); ++i) {
              ASSERT_TRUE(blends.isPrecise(i));
              expectNearest(blends.of(i), views, group[i], &visibility, k);
              const auto nearest = rated(views, group[i], &visibility, k);
              if (nearest.sorted().empty())
                EXPECT_EQ(blends.penalty(i), kInfinity);
              else
                EXPECT_NEAR(blends.penalty(i) / nearest.sorted()[0].penalty, 1, 1e-4);
            }
          }
      }
}

// Includes a first group, which has no limit from a previous one.
TEST_P(NearestSources, ViewsThatFadeLittleAreFoundBehindThoseThatFadeMuch) {
  for (int run = 0; run < 20; ++run)
    for (const size_t k : {3, 4, 7}) {
      const Query query{{0, 0, 0}, randomDirection()};
      std::vector<Source> views;
      VisibilityWeights visibility{0, {}};
      for (size_t i = 0; i < 15; ++i) {
        const bool isFar = i % 3 == 0;
        const Vec3<double> at = query.towards.raw().cast<double>() + (isFar ? 0.7 : 0.05) * randomVector();
        views.push_back({4 * at.normalized(), false});
        visibility.values.push_back(i == 1 ? 0 : isFar ? 255 : 10);
      }
      visibility.views = views.size();
      NearestViews lanes(views, visibility);
      const QueryBlends blends = blendViews(lanes, {&query, 1}, k);
      ASSERT_GT(blends.penalty(0), 0);
      expectNearest(blends.of(0), views, query, &visibility, k);
    }
}

TEST_P(NearestSources, WhatAQueryGetsDoesNotDependOnTheOthers) {
  const auto views = randomSources(300, 0.2), lights = randomSources(70, 0.5);
  const VisibilityWeights visibility = randomFades(views.size(), 0.5);
  NearestViews viewLanes(views, visibility);
  NearestLights lightLanes(lights);
  QueryBlends ofLights;
  for (const double spread : {0.02, 1.0})
    for (int run = 0; run < 20; ++run) {
      const auto group = randomGroup(kQueryLanes, spread);
      const QueryBlends ofViews = blendViews(viewLanes, group, 4);
      ofLights = blendLights(lightLanes, group, 4, ofLights);
      const size_t begin = random() % kQueryLanes, count = 1 + random() % (kQueryLanes - begin);
      const std::span part = std::span(group).subspan(begin, count);
      NearestViews fresh(views, visibility);
      const QueryBlends views2 = blendViews(fresh, part, 4), lights2 = blendLights(lightLanes, part, 4);
      for (size_t i = 0; i < count; ++i) {
        EXPECT_TRUE(areSame(views2.of(i), ofViews.of(begin + i)));
        EXPECT_TRUE(areSame(lights2.of(i), ofLights.of(begin + i)));
      }
    }
}

// Except scalar code without fused multiply-add, which rounds twice.
TEST_P(NearestSources, TheVectorInstructionsGiveTheSameBits) {
  if (GetParam() != Simd::avx512) return; // it is compared with AVX2
  const auto sources = randomSources(200, 0.3);
  const VisibilityWeights visibility = randomFades(sources.size(), 0.6);
  NearestLights lights(sources), others(sources);
  NearestViews views(sources, visibility), otherViews(sources, visibility);
  for (const size_t k : {3, 8, 16})
    for (int run = 0; run < 20; ++run) {
      const auto group = randomGroup(kQueryLanes, 0.1);
      useSimd(Simd::avx2);
      const QueryBlends a = blendLights(lights, group, k), c = blendViews(views, group, k);
      useSimd(Simd::avx512);
      const QueryBlends b = blendLights(others, group, k), d = blendViews(otherViews, group, k);
      for (size_t i = 0; i < group.size(); ++i) {
        EXPECT_TRUE(areSame(a.of(i), b.of(i)));
        EXPECT_TRUE(areSame(c.of(i), d.of(i)));
      }
    }
}

TEST_P(NearestSources, ASourceThatIsMetAnswersAlone) {
  const auto sources = randomSources(100, 0.5);
  NearestLights lanes(sources);
  for (uint32_t i = 0; i < sources.size(); ++i) {
    Query query{randomPlace(0.4), {}};
    query.towards = towards(sources[i], query.place);
    const BlendSet blend = blendLights(lanes, {&query, 1}, 4).of(0);
    ASSERT_FALSE(blend.empty());
    EXPECT_EQ(blend[0].index, i);
    EXPECT_NEAR(blend[0].weight, 1, 1e-7);
  }
}

TEST_P(NearestSources, SourcesThatCoincideAreTakenInTheirOrder) {
  for (const double distant : {0.0, 1.0}) {
    const std::vector<Source> pair = randomSources(2, distant);
    std::vector<Source> sources;
    for (int i = 0; i < 20; ++i) sources.insert(sources.end(), pair.begin(), pair.end());
    VisibilityWeights visibility = randomFades(sources.size(), 1);
    std::ranges::fill(visibility.values, uint8_t{200});
    NearestLights lights(sources);
    NearestViews views(sources, visibility);
    const auto group = randomGroup(kQueryLanes, 0.3);
    for (const QueryBlends& blends : {blendLights(lights, group, 4), blendViews(views, group, 4)})
      for (size_t i = 0; i < group.size(); ++i) {
        const BlendSet blend = blends.of(i);
        ASSERT_EQ(blend.size(), 4u); // the fifth has the same penalty
        for (size_t j = 0; j < 4; ++j) {
          EXPECT_EQ(blend[j].index, blend[0].index + 2 * j);
          EXPECT_LT(blend[0].index, 2u);
          EXPECT_EQ(blend[j].weight, 0.25f);
        }
      }
  }
}

// Sources may coincide with a query's place without having done so in the previous group.
TEST_P(NearestSources, SourcesThatAreMetAreTakenInTheirOrderWhateverCameBefore) {
  const Query query{{0, 0, 0}, randomDirection()};
  const std::vector<Source> sources(6, {query.towards.raw().cast<double>(), true});
  VisibilityWeights visibility = randomFades(sources.size(), 1);
  std::ranges::fill(visibility.values, uint8_t{200});
  visibility.values[0] = 0; // for the first surfel
  NearestViews lanes(sources, visibility);
  const std::array<uint32_t, 2> surfels{0, 1};
  for (const uint32_t surfel : surfels) {
    const BlendSet blend = lanes.blend({&surfel, 1}, {&query.place, 1}, {&query.towards, 1}, 3).of(0);
    ASSERT_EQ(blend.size(), 3u);
    for (uint32_t i = 0; i < 3; ++i) EXPECT_EQ(blend[i].index, i + (surfel == 0)) << surfel;
  }
}

TEST_P(NearestSources, PlacesFarFromTheOriginLoseNothing) {
  const Vec3<double> far(1e4, -3e4, 2e4);
  auto sources = randomSources(60, 0);
  for (Source& source : sources) source.place += far;
  NearestLights lanes(sources);
  for (int run = 0; run < 10; ++run) {
    auto group = randomGroup(kQueryLanes, 0.5);
    for (Query& query : group)
      query.place = assume<Place>((query.place.raw().cast<double>() + far).cast<float>());
    const QueryBlends blends = blendLights(lanes, group, 4);
    for (size_t i = 0; i < group.size(); ++i) expectNearest(blends.of(i), sources, group[i], nullptr, 4);
  }
}

TEST_P(NearestSources, LostDirectionsAreToldAndDisturbNobody) {
  auto sources = randomSources(40, 0.2);
  sources[7] = {{0.25, 0.5, -0.125}, false};
  const VisibilityWeights visibility = randomFades(sources.size(), 0.8);
  NearestLights lights(sources);
  NearestViews views(sources, visibility);
  const auto alone = randomGroup(kQueryLanes, 0.1);
  const QueryBlends lightsAlone = blendLights(lights, alone, 4), viewsAlone = blendViews(views, alone, 4);
  auto group = alone;
  group[3].place = {0.25f, 0.5f, -0.125f};
  group[4].place = {3e20f, 0, 0};
  group[5].place = {kNaN, 0, 0};
  group[9].place = {kInfinity, 0, 0};
  group[10].towards = {kNaN, 0, 1};
  group[11].towards = {0, kInfinity, 0};
  NearestViews others(sources, visibility);
  const QueryBlends ofLights = blendLights(lights, group, 4), ofViews = blendViews(others, group, 4);
  for (size_t i = 0; i < group.size(); ++i) {
    const bool isLost = i == 3 || i == 4 || i == 5 || i == 9;
    EXPECT_EQ(ofLights.isPrecise(i), !isLost);
    EXPECT_EQ(ofViews.isPrecise(i), !isLost);
    if (i == 10 || i == 11) {
      EXPECT_TRUE(ofLights.of(i).empty());
      EXPECT_TRUE(ofViews.of(i).empty());
      EXPECT_EQ(ofViews.penalty(i), kInfinity);
    } else if (!isLost) {
      EXPECT_TRUE(areSame(ofLights.of(i), lightsAlone.of(i)));
      EXPECT_TRUE(areSame(ofViews.of(i), viewsAlone.of(i)));
    }
  }
}

TEST_P(NearestSources, WithoutSourcesThereIsNothing) {
  NearestLights lights({});
  const VisibilityWeights none{0, {}};
  NearestViews views({}, none);
  const auto group = randomGroup(3, 0.1);
  EXPECT_TRUE(blendLights(lights, group, 3).of(1).empty());
  EXPECT_TRUE(blendViews(views, group, 3).of(2).empty());
}

// With many views and neighbouring queries, few views can be within the limit; all that are must be found.
TEST_P(NearestSources, FewAreWithinALimitAndNoneIsMissed) {
  const size_t count = 4000;
  const auto sources = randomSources(count, 0.1);
  std::vector<float> x, y, z, isNear;
  for (const auto& [place, isDistant] : sources) {
    x.push_back(static_cast<float>(place[0]));
    y.push_back(static_cast<float>(place[1]));
    z.push_back(static_cast<float>(place[2]));
    isNear.push_back(isDistant ? 0 : 1);
  }
  std::vector<uint32_t> found(count + kQueryLanes);
  size_t all = 0;
  for (const float reach : {0.f, 0.01f, 0.3f, 3.f})
    for (int run = 0; run < 20; ++run) {
      const Vec3<float> middle = randomPlace(0.4).raw(), direction = randomDirection().raw();
      const float limit = std::uniform_real_distribution(0.f, 0.02f)(random);
      float distance = std::numeric_limits<float>::infinity();
      for (const auto& [place, isDistant] : sources)
        if (!isDistant) distance = std::min(distance, (place.cast<float>() - middle).norm());
      // As in NearestViews: places of sources are rounded.
      const float radius = (1 + 1e-5f) * reach + 4 * 4 * std::numeric_limits<float>::epsilon();
      const SourceCone cone =
          coneAround({middle[0], middle[1], middle[2]}, radius, 0.99999f * distance,
                     {direction[0], direction[1], direction[2]}, (1 + 1e-5f) * reach, limit);
      const size_t within =
          findInCone(x.data(), y.data(), z.data(), isNear.data(), count / kQueryLanes, cone, found.data());
      EXPECT_TRUE(std::ranges::is_sorted(std::span(found).first(within)));
      if (reach < 0.1f) all += within;
      for (int member = 0; member < 20; ++member) {
        const auto shifted = [&](const Vec3<float>& from) {
          return Vec3<float>(from +
                             std::uniform_real_distribution(0.f, reach)(random) * randomDirection().raw());
        };
        const Query query{assume<Place>(shifted(middle)), assume<Direction>(shifted(direction))};
        for (uint32_t i = 0; i < count; ++i)
          if (penaltyOf(sources[i], query, nullptr, i) <= limit) {
            EXPECT_TRUE(std::ranges::binary_search(std::span(found).first(within), i));
          }
      }
    }
  EXPECT_LT(all, 40 * count / 50);
  EXPECT_GT(all, 40u);
}

INSTANTIATE_TEST_SUITE_P(Simd, NearestSources, testing::ValuesIn(supportedSimd()),
                         [](const auto& simd) { return std::string(nameOf(simd.param)); });

} // namespace
} // namespace surflect::weights
