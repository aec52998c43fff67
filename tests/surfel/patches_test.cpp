#include "surfel/patches.h"

#include "surfel/sampling.h"

#include <gtest/gtest.h>

#include <cmath>
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
} // namespace surflect
