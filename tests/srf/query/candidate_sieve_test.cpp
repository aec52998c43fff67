#include "srf/query/candidate_sieve.h"

#include "srf/query/ulr.h"
#include "srf/query/view_fade.h"

#include <gtest/gtest.h>

#include <random>

namespace surflect {
namespace {

using Direction = Direction3<AcquisitionSpace>;

class Sieved : public testing::TestWithParam<Simd> {
protected:
  Vec3<double> randomVector() { return {normal_(random), normal_(random), normal_(random)}; }
  Direction randomDirection() { return assume<Direction>(randomVector().normalized().cast<float>()); }
  Source randomSource(double radius, bool isDistant) {
    const Vec3<double> towards = randomVector().normalized();
    return {isDistant ? towards : Vec3<double>(radius * towards), isDistant};
  }
  std::vector<uint8_t> randomFades(size_t count, double share) {
    std::vector<uint8_t> fades(count);
    for (auto& fade : fades)
      if (std::uniform_real_distribution()(random) < share) fade = static_cast<uint8_t>(1 + random() % 255);
    return fades;
  }

  std::mt19937_64 random{1};

private:
  std::normal_distribution<double> normal_;
};

// As ViewPenalties and the planner rate a source.
Direction towards(const Source& source, const Vec3<double>& place) {
  const Vec3<double> to = source.isDistant ? source.place : Vec3<double>((source.place - place).normalized());
  return assume<Direction>(to.cast<float>());
}

NearestCandidates rated(std::span<const uint32_t> indices, std::span<const Source> sources,
                        const Vec3<double>& place, const Direction& query, size_t k,
                        std::span<const uint8_t> fades, bool byFade) {
  NearestCandidates nearest(k);
  for (const uint32_t i : indices) {
    if (!fades.empty() && fades[i] == 0) continue;
    const float penalty = anglePenalty(towards(sources[i], place), query);
    nearest.offer({i, byFade && !fades.empty() ? penalty / ViewFades::decode(fades[i]) : penalty});
  }
  return nearest;
}

// How many the sieve leaves, on the mean. Expects that rating these is rating all.
double expectSame(std::span<const Source> sources, std::span<const Vec3<double>> places,
                  const Vec3<double>& middle, std::span<const Direction> queries,
                  std::span<const uint8_t> fades, Simd simd) {
  CandidateSieve sieve(sources, middle, simd);
  std::vector<uint32_t> all(sources.size());
  for (uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  double left = 0;
  size_t runs = 0;
  for (const auto& place : places) {
    sieve.lookFrom(place);
    for (const auto& query : queries)
      for (const size_t k : {1, 4, 16})
        for (const bool byFade : {true, false}) {
          const auto found = sieve.nearest(query, k + 1, fades, byFade);
          left += static_cast<double>(found.size());
          ++runs;
          EXPECT_TRUE(std::ranges::is_sorted(found));
          for (const uint32_t i : found) EXPECT_TRUE(i < sources.size() && (fades.empty() || fades[i] > 0));
          const auto got = rated(found, sources, place, query, k, fades, byFade),
                     wanted = rated(all, sources, place, query, k, fades, byFade);
          EXPECT_EQ(got.sorted().size(), wanted.sorted().size());
          for (size_t i = 0; i < std::min(got.sorted().size(), wanted.sorted().size()); ++i) {
            EXPECT_EQ(got.sorted()[i].index, wanted.sorted()[i].index);
            EXPECT_EQ(got.sorted()[i].penalty, wanted.sorted()[i].penalty);
          }
        }
  }
  return left / static_cast<double>(runs);
}

TEST_P(Sieved, TheNearestOfRandomRigsAreThoseOfAll) {
  for (const size_t count : {1, 2, 5, 16, 17, 60, 432})
    for (const double share : {1.0, 0.4, 0.03}) {
      std::vector<Source> sources;
      for (size_t i = 0; i < count; ++i) sources.push_back(randomSource(4, random() % 3 == 0));
      std::vector<Vec3<double>> places;
      std::vector<Direction> queries;
      for (int i = 0; i < 8; ++i)
        places.push_back(0.4 * randomVector()), queries.push_back(randomDirection());
      queries.push_back(towards(sources[0], places[0]));
      expectSame(sources, places, Vec3<double>(0.1, 0.2, 0), queries, randomFades(count, share), GetParam());
      expectSame(sources, places, Vec3<double>(0.1, 0.2, 0), queries, {}, GetParam());
    }
}

TEST_P(Sieved, OfManySourcesFewAreLeft) {
  std::vector<Source> views, lights;
  for (int i = 0; i < 20'000; ++i)
    views.push_back(randomSource(3, false)), lights.push_back(randomSource(1, true));
  const std::vector<Vec3<double>> places{{0.1, 0, 0.2}};
  const std::vector<Direction> queries{randomDirection(), randomDirection(), randomDirection()};
  for (const auto& sources : {views, lights})
    EXPECT_LT(expectSame(sources, places, Vec3<double>::Zero(), queries, {}, GetParam()), 40);
}

TEST_P(Sieved, SourcesThatCoincideOrLieNearlyAlikeAreToldApart) {
  std::vector<Source> sources;
  const Source one = randomSource(2, false), other = randomSource(1, true);
  for (int i = 0; i < 40; ++i) {
    sources.push_back(one);
    sources.push_back({one.place + 1e-7 * randomVector(), false});
    sources.push_back(other);
    sources.push_back({(other.place + 1e-7 * randomVector()).normalized(), true});
  }
  const std::vector<Vec3<double>> places{{0, 0, 0}, {0.3, -0.1, 0.2}};
  std::vector<Direction> queries{randomDirection(), towards(one, places[0]), towards(one, places[1]),
                                 towards(other, places[0])};
  expectSame(sources, places, Vec3<double>::Zero(), queries, {}, GetParam());
  expectSame(sources, places, Vec3<double>::Zero(), queries, randomFades(sources.size(), 0.7), GetParam());
}

TEST_P(Sieved, NoneIsMissedNearASourceNorFarFromTheMiddle) {
  for (const double unit : {1e-25, 1e-3, 1.0, 1e25}) {
    std::vector<Source> sources;
    std::vector<Vec3<double>> places;
    std::vector<Direction> queries;
    for (int i = 0; i < 70; ++i) sources.push_back({unit * randomVector(), false});
    for (const double near : {1e-12, 1e-6, 1e-3, 1e-1, 1e2, 1e6})
      places.push_back(sources[7].place + near * unit * randomVector());
    places.push_back(sources[9].place);
    for (int i = 0; i < 4; ++i) queries.push_back(randomDirection());
    expectSame(sources, places, unit * randomVector(), queries, randomFades(sources.size(), 0.8), GetParam());
  }
}

TEST_P(Sieved, WhatNobodySeesHasNoCandidates) {
  const std::vector<Source> sources(20, randomSource(2, false));
  CandidateSieve sieve(sources, Vec3<double>::Zero(), GetParam());
  sieve.lookFrom(Vec3<double>::Zero());
  EXPECT_TRUE(sieve.nearest(randomDirection(), 5, std::vector<uint8_t>(20, 0)).empty());
  EXPECT_TRUE(CandidateSieve({}, Vec3<double>::Zero(), GetParam()).nearest(randomDirection(), 5).empty());
}

INSTANTIATE_TEST_SUITE_P(Simd, Sieved, testing::ValuesIn(supportedSimd()),
                         [](const auto& simd) { return std::string(nameOf(simd.param)); });

} // namespace
} // namespace surflect
