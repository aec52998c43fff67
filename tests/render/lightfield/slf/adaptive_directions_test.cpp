#include "render/lightfield/slf/adaptive_directions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace surflect::slf {
namespace {

constexpr size_t kTexelCount = 8;

// Radiance that is equal in all texels and observed from everywhere.
DirectionalRadiance radianceIn(const DirectionMesh& fine,
                               const std::function<double(const Vec3<double>&)>& of) {
  DirectionalRadiance result;
  for (const Direction& direction : fine.directions()) {
    result.radiance.emplace_back(kTexelCount, Vec3<float>::Constant(static_cast<float>(of(direction.raw()))));
    result.isObserved.emplace_back(kTexelCount, 1);
  }
  return result;
}

DirectionMesh subsetOf(const DirectionMesh& fine, const std::vector<size_t>& kept) {
  std::vector<Direction> directions;
  for (const size_t i : kept) directions.push_back(fine.directions()[i]);
  return DirectionMesh(directions);
}

const Vec3<double> kMirror = Vec3<double>(1, 0.7, 2).normalized();
double highlight(const Vec3<double>& d) { return 0.2 + std::pow(std::max(0.0, d.dot(kMirror)), 30); }

TEST(AdaptiveDirections, AMatteRegionKeepsTheSixOfTheOctahedron) {
  const DirectionMesh fine(octahedronDirections(3));
  const auto kept = adaptedDirections(radianceIn(fine, [](const auto&) { return 0.7; }), fine, 1e-6);
  EXPECT_EQ(kept, (std::vector<size_t>{0, 1, 2, 3, 4, 5}));
}

TEST(AdaptiveDirections, AHighlightKeepsDirectionsNearTheMirrorDirection) {
  const DirectionMesh fine(octahedronDirections(3));
  const auto kept = adaptedDirections(radianceIn(fine, highlight), fine, 0.02);
  EXPECT_GT(kept.size(), 12u);
  EXPECT_LT(kept.size(), 66u);
  const auto share = [&](const auto& isCounted) {
    size_t all = 0, ours = 0;
    for (size_t i = 0; i < fine.directions().size(); ++i)
      if (isCounted(fine.directions()[i].raw().dot(kMirror))) {
        ++all;
        ours += std::ranges::binary_search(kept, i);
      }
    return static_cast<double>(ours) / static_cast<double>(all);
  };
  EXPECT_GT(share([](double cosine) { return cosine > 0.9; }), 0.5);
  EXPECT_LT(share([](double cosine) { return cosine < 0.5; }), 0.1);
}

TEST(AdaptiveDirections, WhatIsLeftOutIsReproducedWithinTheTolerance) {
  const DirectionMesh fine(octahedronDirections(3));
  const DirectionalRadiance radiance = radianceIn(fine, highlight);
  size_t before = fine.directions().size() + 1;
  for (const double tolerance : {0.003, 0.01, 0.03, 0.1}) {
    const auto kept = adaptedDirections(radiance, fine, tolerance);
    for (const double error : reproductionErrors(radiance, fine, kept, subsetOf(fine, kept)))
      EXPECT_LE(error, tolerance);
    EXPECT_LT(kept.size(), before);
    before = kept.size();
  }
}

TEST(AdaptiveDirections, WithoutToleranceEverythingThatBendsIsKept) {
  const DirectionMesh fine(octahedronDirections(1));
  const auto kept = adaptedDirections(radianceIn(fine, highlight), fine, 0);
  for (const double error : reproductionErrors(radianceIn(fine, highlight), fine, kept, subsetOf(fine, kept)))
    EXPECT_EQ(error, 0);
}

TEST(AdaptiveDirections, DirectionsThatNoPhotographIsNearAreNotJudged) {
  const DirectionMesh fine(octahedronDirections(2));
  DirectionalRadiance radiance = radianceIn(fine, highlight);
  for (auto& observed : radiance.isObserved) std::ranges::fill(observed, 0);
  EXPECT_EQ(adaptedDirections(radiance, fine, 1e-6).size(), 6u);
}

TEST(AdaptiveDirections, TheErrorIsTheRootMeanSquareOverObservedTexels) {
  const DirectionMesh fine(octahedronDirections(1));
  DirectionalRadiance radiance = radianceIn(fine, [](const auto&) { return 1.0; });
  constexpr size_t kEdge = 6; // the first direction that is not of the octahedron
  radiance.radiance[kEdge][0] = {4, 1, 1};
  radiance.radiance[kEdge][1] = {1, 5, 1};
  radiance.radiance[kEdge][2] = {900, 1, 1};
  radiance.isObserved[kEdge][2] = 0;
  const std::vector<size_t> kept = {0, 1, 2, 3, 4, 5};
  const auto errors = reproductionErrors(radiance, fine, kept, subsetOf(fine, kept));
  EXPECT_NEAR(errors[kEdge], std::sqrt((9.0 + 16.0) / (3 * (kTexelCount - 1))), 1e-6);
  EXPECT_NEAR(errors[kEdge + 1], 0, 1e-6);
}

} // namespace
} // namespace surflect::slf
