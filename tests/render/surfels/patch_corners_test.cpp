#include "render/surfels/patch_corners.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

namespace surflect::surfels {
namespace {

// A cloud of points on a plane, in patches of the given sizes, and its visible surfels.
struct Plane {
  SurfelCloud cloud;
  Patches patches;
  std::vector<uint32_t> visible;

  explicit Plane(std::span<const uint32_t> sizes) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> any(0, 1);
    patches.first = {0};
    for (const uint32_t size : sizes) {
      patches.middle.push_back(patches.first.back());
      patches.first.push_back(patches.first.back() + size);
    }
    for (uint32_t i = 0; i < patches.first.back(); ++i) {
      const float x = any(random), y = any(random);
      cloud.p0.push_back({x, y, 0.25f});
      if (i % 5 != 3) visible.push_back(i);
    }
    cloud.r0.resize(cloud.p0.size());
  }
};

// Mean of a function of places over the corners of a group, by the weights of a place.
template <class Function>
float blended(const PatchCorners& all, const Plane& plane, size_t group, uint32_t place, const Function& of) {
  float sum = 0;
  for (size_t k = 0; k < 4; ++k)
    sum += all.weights[place][k] * of(plane.cloud.p0[plane.visible[all.corners[4 * group + k]]]);
  return sum;
}

const std::vector<uint32_t> kSizes{16, 3, 40, 1, 5, 64, 2};

TEST(PatchCorners, EveryVisibleSurfelIsInOneGroupOfItsPatchAndItsWeightsSumToOne) {
  const Plane plane(kSizes);
  const PatchCorners all = patchCorners(plane.cloud, plane.patches, plane.visible, {}, 0);
  ASSERT_EQ(all.corners.size(), 4 * (all.firstPlace.size() - 1));
  EXPECT_EQ(all.firstPlace.front(), 0u);
  EXPECT_EQ(all.firstPlace.back(), plane.visible.size());
  const auto patchOf = [&](uint32_t place) {
    return std::ranges::upper_bound(plane.patches.first, plane.visible[place]) - plane.patches.first.begin();
  };
  for (size_t group = 0; group + 1 < all.firstPlace.size(); ++group) {
    ASSERT_LT(all.firstPlace[group], all.firstPlace[group + 1]);
    for (uint32_t place = all.firstPlace[group]; place < all.firstPlace[group + 1]; ++place) {
      EXPECT_NEAR(std::accumulate(all.weights[place].begin(), all.weights[place].end(), 0.f), 1, 1e-6);
      for (size_t k = 0; k < 4; ++k) {
        EXPECT_GE(all.weights[place][k], 0);
        if (all.weights[place][k] > 0) {
          EXPECT_EQ(patchOf(all.corners[4 * group + k]), patchOf(place));
        }
      }
    }
  }
}

// Beyond the corners' triangles, where a coordinate is 0, they need not be.
TEST(PatchCorners, LinearFunctionsAreAnsweredExactlyBetweenTheCorners) {
  const Plane plane(kSizes);
  const PatchCorners all = patchCorners(plane.cloud, plane.patches, plane.visible, {}, 0);
  const auto linear = [](const Point3<AcquisitionSpace>& p) { return 1 + 2 * p.x() - 3 * p.y(); };
  size_t inside = 0;
  for (size_t group = 0; group + 1 < all.firstPlace.size(); ++group)
    for (uint32_t place = all.firstPlace[group]; place < all.firstPlace[group + 1]; ++place) {
      if (std::ranges::count_if(all.weights[place], [](float weight) { return weight > 0; }) < 3) continue;
      ++inside;
      EXPECT_NEAR(blended(all, plane, group, place, linear), linear(plane.cloud.p0[plane.visible[place]]),
                  1e-5);
    }
  EXPECT_GT(inside, plane.visible.size() / 3);
}

// Whether a surfel is its own corner.
bool answersForItself(const PatchCorners& all, uint32_t place) {
  const auto group =
      static_cast<size_t>(std::ranges::upper_bound(all.firstPlace, place) - all.firstPlace.begin() - 1);
  for (size_t k = 0; k < 4; ++k)
    if (all.weights[place][k] == 1 && all.corners[4 * group + k] == place) return true;
  return false;
}

TEST(PatchCorners, SurfelsAnswerForThemselvesInSmallPatchesAndAtTheEdgeOfAShadow) {
  const Plane plane(kSizes); // 13 surfels of the first patch are visible, and 2 of the second
  std::vector<float> reached(2 * plane.visible.size(), 1);
  const PatchCorners lit = patchCorners(plane.cloud, plane.patches, plane.visible, reached, 2);
  for (size_t place = 0; place < 5; ++place) reached[2 * place + 1] = 0;
  const PatchCorners edge = patchCorners(plane.cloud, plane.patches, plane.visible, reached, 2);
  size_t ofLit = 0;
  for (uint32_t place = 0; place < 15; ++place) {
    ofLit += answersForItself(lit, place);
    EXPECT_TRUE(answersForItself(edge, place));
  }
  EXPECT_LT(ofLit, 8u); // four corners and a small patch
  // Few queries are asked twice.
  EXPECT_EQ(edge.firstPlace[4], 15u);
}

TEST(PatchCorners, GroupsChangeWhereAShadowBeginsAndCanBeAskedAlone) {
  const Plane plane(kSizes);
  std::vector<float> reached(plane.visible.size(), 1);
  const PatchCorners lit = patchCorners(plane.cloud, plane.patches, plane.visible, reached, 1);
  EXPECT_TRUE(changedGroups(lit, lit).empty());
  EXPECT_EQ(changedGroups({}, lit).size(), lit.groups());
  const size_t shadowed = plane.visible.size() / 2; // in the patch of 64
  for (size_t place = shadowed; place < shadowed + 3; ++place) reached[place] = 0;
  const PatchCorners edge = patchCorners(plane.cloud, plane.patches, plane.visible, reached, 1);
  const std::vector<uint32_t> changed = changedGroups(lit, edge);
  EXPECT_GT(changed.size(), 8u);
  EXPECT_LT(changed.size(), edge.groups());

  std::vector<uint32_t> places;
  const PatchCorners some = someGroups(edge, changed, places);
  ASSERT_EQ(some.groups(), changed.size());
  EXPECT_EQ(some.firstPlace.back(), places.size());
  for (size_t i = 0; i < places.size(); ++i) EXPECT_EQ(some.weights[i], edge.weights[places[i]]);
  for (size_t group = 0; group < changed.size(); ++group)
    for (size_t k = 0; k < 4; ++k)
      EXPECT_EQ(places[some.corners[4 * group + k]], edge.corners[4 * changed[group] + k]);
  for (uint32_t place = 0; place < plane.visible.size(); ++place) // of unchanged groups
    if (std::ranges::find(places, place) == places.end()) EXPECT_EQ(lit.weights[place], edge.weights[place]);
}

} // namespace
} // namespace surflect::surfels
