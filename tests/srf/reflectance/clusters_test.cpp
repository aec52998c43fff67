#include "srf/reflectance/clusters.h"

#include "tests/srf/reflectance/planted.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <numeric>
#include <set>

namespace surflect::reflectance {
namespace {

// Surfels of the materials in turn, each with a gain of its own.
PhotographArrays mixed(std::span<const planted::Material> materials, size_t surfels, size_t photographs,
                       unsigned seed) {
  std::mt19937 random(seed);
  PhotographArrays captured;
  for (size_t s = 0; s < surfels; ++s)
    planted::addSurfel(captured, materials[s % materials.size()], planted::randomGain(random), photographs,
                       random);
  return captured;
}

// Part of the surfels whose cluster is that of most surfels of their material.
double purity(const Clusters& clusters, size_t materials) {
  size_t right = 0;
  for (size_t m = 0; m < materials; ++m) {
    std::vector<size_t> counts(clusters.count);
    for (size_t s = m; s < clusters.of.size(); s += materials) ++counts[clusters.of[s]];
    right += *std::ranges::max_element(counts);
  }
  return static_cast<double>(right) / static_cast<double>(clusters.of.size());
}

const std::vector<planted::Material> kThree{planted::kMatte, planted::kGlossy, planted::kBrushed};

TEST(Clusters, AreThePlantedMaterials) {
  const PhotographArrays captured = mixed(kThree, 150, 80, 1);
  const Clusters clusters = findClusters(captured.view(), {.white = planted::kWhite});
  EXPECT_EQ(clusters.count, 3u);
  EXPECT_GT(purity(clusters, 3), 0.97);
}

TEST(Clusters, OfOneMaterialAreOne) {
  const PhotographArrays captured = mixed(std::span(kThree).subspan(1, 1), 150, 60, 2);
  EXPECT_EQ(findClusters(captured.view(), {.white = planted::kWhite}).count, 1u);
}

TEST(Clusters, AreTheSameForAnyNumberOfThreads) {
  const PhotographArrays captured = mixed(kThree, 60, 40, 3);
  const ClusterOptions options{.white = planted::kWhite, .mostClusters = 4};
  const Clusters many = findClusters(captured.view(), options);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const Clusters again = findClusters(captured.view(), options);
  EXPECT_EQ(again.of, many.of);
  EXPECT_EQ(again.errors, many.errors);
}

TEST(Clusters, SurfelsWithoutPhotographsBelongSomewhere) {
  PhotographArrays captured = mixed(kThree, 30, 40, 4);
  std::mt19937 random(5);
  planted::addSurfel(captured, planted::kMatte, {1, 1, 1}, 0, random);
  const Clusters clusters = findClusters(captured.view(), {.white = planted::kWhite, .mostClusters = 3});
  ASSERT_EQ(clusters.of.size(), 31u);
  EXPECT_LT(clusters.of.back(), clusters.count);
  PhotographArrays none;
  planted::addSurfel(none, planted::kMatte, {1, 1, 1}, 0, random);
  EXPECT_EQ(findClusters(none.view(), {}).of, std::vector<uint32_t>{0});
}

TEST(Clusters, OfOnePhotographEachAreOneAsNothingTellsThemApart) {
  EXPECT_EQ(findClusters(mixed(kThree, 30, 1, 8).view(), {.white = planted::kWhite}).count, 1u);
}

TEST(KMeans, FindsSeparateGroupsAndAtMostAsManyAsThereAreProfiles) {
  std::mt19937 random(6);
  std::normal_distribution<float> noise(0, 0.1f);
  std::vector<RingProfile> profiles(90);
  for (size_t s = 0; s < profiles.size(); ++s)
    for (float& x : profiles[s]) x = static_cast<float>(s % 3) + noise(random);
  const auto cluster = kMeans(profiles, 3);
  for (size_t s = 3; s < cluster.size(); ++s) EXPECT_EQ(cluster[s], cluster[s % 3]);
  EXPECT_EQ(std::set(cluster.begin(), cluster.end()).size(), 3u);
  const std::vector<RingProfile> same(5, profiles[0]);
  EXPECT_EQ(kMeans(same, 3), std::vector<uint32_t>(5, 0));
}

double weightOf(const TableMixture& mixture, uint16_t table) {
  double sum = 0;
  for (size_t m = 0; m < kMixedTables; ++m) sum += mixture.table[m] == table ? mixture.weight[m] : 0;
  return sum;
}

TEST(Mixture, SumsToOneAndPrefersTheTableOfLeastError) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> error(0, 1);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<float> errors(1 + random() % 8);
    for (float& e : errors) e = error(random);
    const TableMixture mixture = mixtureOf(errors);
    EXPECT_NEAR(std::accumulate(mixture.weight.begin(), mixture.weight.end(), 0.0), 1, 1e-6);
    const auto best = static_cast<uint16_t>(std::ranges::min_element(errors) - errors.begin());
    for (uint16_t table = 0; table < errors.size(); ++table)
      EXPECT_LE(weightOf(mixture, table), weightOf(mixture, best));
  }
  EXPECT_EQ(weightOf(mixtureOf(std::vector{0.2f, 0.2f}), 0), 0.5);
}

TEST(Mixture, IsContinuousInTheErrors) {
  const std::vector<float> from{0.1f, 0.3f, 0.25f, 0.4f, 0.15f}, to{0.35f, 0.12f, 0.3f, 0.2f, 0.22f};
  std::vector<double> before;
  for (int step = 0; step <= 10000; ++step) {
    const float t = static_cast<float>(step) / 10000;
    std::vector<float> errors;
    for (size_t i = 0; i < from.size(); ++i) errors.push_back((1 - t) * from[i] + t * to[i]);
    const TableMixture mixture = mixtureOf(errors);
    std::vector<double> now;
    for (uint16_t table = 0; table < errors.size(); ++table) now.push_back(weightOf(mixture, table));
    for (size_t i = 0; i < before.size(); ++i) EXPECT_NEAR(now[i], before[i], 6e-4);
    before = now;
  }
}

TEST(Mixture, ShareOfTheTableFallsAsOtherPhotographsPredictAsWell) {
  EXPECT_EQ(tableShare(0.1f, 1), 1);
  EXPECT_EQ(tableShare(1, 1), 0);
  EXPECT_EQ(tableShare(2, 1), 0);
  EXPECT_EQ(tableShare(0, 0), 0);
  float before = 1;
  for (float error = 0.5f; error < 1.2f; error += 0.001f) {
    const float share = tableShare(error, 1);
    EXPECT_LE(share, before);
    EXPECT_NEAR(share, before, 0.01);
    before = share;
  }
}

} // namespace
} // namespace surflect::reflectance
