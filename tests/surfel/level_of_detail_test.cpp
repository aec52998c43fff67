#include "surfel/level_of_detail.h"

#include "surfel/geometry/neighbors.h"
#include "surfel/sampling.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace surflect {

namespace {

// Two parallel squares that face away from each other, a tenth of a spacing apart.
SurfelCloud thinWall() {
  TriangleMesh mesh;
  for (const float z : {0.f, 0.004f})
    for (const auto& [x, y] : {std::pair(0.f, 0.f), {1.f, 0.f}, {1.f, 1.f}, {0.f, 1.f}})
      mesh.positions.emplace_back(x, y, z);
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}};
  return sampleSurfels(mesh, 0.04);
}

TEST(Patches, AreNeighboursOnOneSheet) {
  const SurfelCloud cloud = thinWall();
  for (const size_t most : {1, 4, 64}) {
    const Patches patches = patchesOf(cloud, most);
    ASSERT_EQ(patches.first.size(), patches.size() + 1);
    EXPECT_EQ(patches.first.front(), 0u);
    EXPECT_EQ(patches.first.back(), cloud.size());
    for (size_t patch = 0; patch < patches.size(); ++patch) {
      const uint32_t begin = patches.first[patch], end = patches.first[patch + 1];
      ASSERT_LT(begin, end);
      EXPECT_LE(end - begin, most);
      EXPECT_LE(begin, patches.middle[patch]);
      EXPECT_LT(patches.middle[patch], end);
      for (uint32_t i = begin; i < end; ++i) {
        EXPECT_EQ(rotationOf<float>(cloud.r0[i])(2, 2) > 0, rotationOf<float>(cloud.r0[begin])(2, 2) > 0);
        EXPECT_LT((cloud.p0[i] - cloud.p0[begin]).raw().norm(), 1.5 * std::sqrt(double(most)) * 0.06);
      }
    }
  }
}

TEST(Patches, OfACoarseCloudAreSmall) {
  const SurfelCloud cloud = thinWall();
  const Patches patches = patchesOf(cloud, 64);
  for (size_t patch = 0; patch < patches.size(); ++patch)
    for (uint32_t i = patches.first[patch]; i < patches.first[patch + 1]; ++i)
      EXPECT_LE((cloud.p0[i] - cloud.p0[patches.first[patch]]).raw().norm(), 0.02 * std::sqrt(2.0) * 1.001);
}

TEST(Patches, OfNothingAreNone) { EXPECT_EQ(patchesOf({}, 4).size(), 0u); }

} // namespace

namespace {

constexpr double kSpacing = 0.08;

TriangleMesh ball() {
  TriangleMesh mesh;
  constexpr int rings = 32, across = 2 * rings;
  for (int i = 0; i <= rings; ++i)
    for (int j = 0; j < across; ++j) {
      const double theta = std::numbers::pi * i / rings, phi = 2 * std::numbers::pi * j / across;
      mesh.positions.push_back(assume<Point3<AcquisitionSpace>>(
          Vec3<double>(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta))));
    }
  const auto at = [](int i, int j) { return static_cast<uint32_t>(i * across + j % across); };
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < across; ++j) {
      if (i + 1 < rings) mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      if (i > 0) mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return mesh;
}

struct Ball {
  SurfelCloud cloud = sampleSurfels(ball(), kSpacing);
  LevelsOfDetail levels = levelsOfDetail(cloud);

  // The cloud at level l + t.
  SurfelCloud at(size_t l, float t) const {
    SurfelCloud drawn;
    for (size_t i = 0; i < cloud.size(); ++i)
      if (const auto splat = splatAt(levels.of(i), l, t)) {
        drawn.p0.push_back(cloud.p0[i]);
        drawn.radius.push_back(splat->radius);
        drawn.coverage.push_back(splat->coverage);
      }
    return drawn;
  }
};

const Ball& theBall() {
  static const Ball ball;
  return ball;
}

TEST(LevelOfDetail, EachLevelIsAnEvenHalfOfTheOneBefore) {
  size_t before = theBall().cloud.size();
  ASSERT_GE(theBall().levels.count, 4u);
  for (size_t l = 1; l < theBall().levels.count; ++l) {
    const SurfelCloud level = theBall().at(l, 0);
    EXPECT_EQ(level.size(), (before + 1) / 2);
    before = level.size();
    const NeighborIndex index(level.p0);
    const double spacing = kSpacing * std::pow(2, static_cast<double>(l) / 2);
    double least = 10;
    for (size_t i = 0; i < level.size(); ++i) {
      least = std::min(least, index.nearest(level.p0[i], 2)[1].distance / spacing);
      EXPECT_NEAR(level.radius[i] / spacing, 1.1, 0.35);
    }
    EXPECT_GT(least, 0.4) << l;
  }
}

// Partition of unity at and between levels, at places between the surfels.
TEST(LevelOfDetail, GaussiansSumToOneAtEveryLevel) {
  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  for (size_t l = 0; l < 4; ++l) // beyond, surfels are too few for so curved a surface
    for (const float t : {0.f, 0.25f, 0.5f, 0.75f}) {
      const SurfelCloud drawn = theBall().at(l, t);
      double sum = 0, squares = 0;
      constexpr int places = 300;
      for (int place = 0; place < places; ++place) {
        const Vec3<float> p = Vec3<float>(normal(random), normal(random), normal(random)).normalized();
        double here = 0;
        for (size_t i = 0; i < drawn.size(); ++i) {
          const double ratio = (drawn.p0[i].raw() - p).norm() / (kSigmaPerRadius * drawn.radius[i]);
          here += drawn.coverage[i] * std::exp(-0.5 * ratio * ratio);
        }
        sum += here;
        squares += (here - 1) * (here - 1);
      }
      EXPECT_NEAR(sum / places, 1, 0.025) << l << " + " << t;
      EXPECT_LT(std::sqrt(squares / places), 0.06) << l << " + " << t;
    }
}

TEST(LevelOfDetail, BetweenLevelsASplatHasTheMassAndVarianceOfTheirMixture) {
  const std::vector<DetailSplat> levels{{1, 0.4f}, {1.5f, 0.42f}};
  const auto mass = [](const DetailSplat& s) { return double{s.coverage} * s.radius * s.radius; };
  const auto variance = [&](const DetailSplat& s) { return mass(s) * s.radius * s.radius; };
  for (const float t : {0.f, 0.3f, 0.9f, 1.f}) {
    const DetailSplat splat = *splatAt(levels, 0, t), fading = *splatAt(levels, 1, t);
    EXPECT_NEAR(mass(splat), (1 - t) * mass(levels[0]) + t * mass(levels[1]), 1e-6);
    EXPECT_NEAR(variance(splat), (1 - t) * variance(levels[0]) + t * variance(levels[1]), 1e-6);
    EXPECT_EQ(fading.radius, levels[1].radius);
    EXPECT_NEAR(fading.coverage, (1 - t) * levels[1].coverage, 1e-7);
  }
  EXPECT_EQ(splatAt(levels, 2, 0), std::nullopt);
}

// A level of one side alone would open the other.
TEST(LevelOfDetail, BothSidesOfAThinWallKeepHalf) {
  TriangleMesh mesh;
  for (const float z : {0.f, 0.01f})
    for (const auto& [x, y] : {std::pair(0.f, 0.f), {1.f, 0.f}, {1.f, 1.f}, {0.f, 1.f}})
      mesh.positions.emplace_back(x, y, z);
  mesh.triangles = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}};
  const SurfelCloud wall = sampleSurfels(mesh, 0.04);
  const SurfelCloud half = subsetOf(wall, everySecond(wall));
  const auto upper = [](const SurfelCloud& cloud) {
    return static_cast<double>(std::ranges::count(cloud.r0, 0.f, &Rodrigues::lower));
  };
  EXPECT_NEAR(upper(half) / upper(wall), 0.5, 0.03);
}

TEST(LevelOfDetail, OfFewSurfelsIsOneLevel) {
  EXPECT_EQ(levelsOfDetail({}).count, 1u);
  EXPECT_EQ(levelsOfDetail(subsetOf(theBall().cloud, std::vector<uint32_t>{4, 5, 6})).count, 1u);
}

} // namespace

} // namespace surflect
