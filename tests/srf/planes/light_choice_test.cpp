#include "srf/planes/light_choice.h"

#include "srf/planes/normals.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

namespace surflect::planes {
namespace {

// A dome of `arcs` quarter circles from the rim to the top, `anArc` lamps each, arc by arc.
std::vector<Vec3<double>> domeOfArcs(size_t arcs, size_t anArc) {
  std::vector<Vec3<double>> towards;
  for (size_t a = 0; a < arcs; ++a)
    for (size_t k = 0; k < anArc; ++k) {
      const double azimuth = 2 * std::numbers::pi * static_cast<double>(a) / static_cast<double>(arcs),
                   elevation = 0.1 + 1.2 * static_cast<double>(k) / static_cast<double>(anArc);
      towards.emplace_back(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                           std::sin(elevation));
    }
  return towards;
}

std::vector<Vec3<double>> of(const std::vector<Vec3<double>>& all, const std::vector<size_t>& chosen) {
  std::vector<Vec3<double>> some;
  for (const size_t l : chosen) some.push_back(all[l]);
  return some;
}

// Every twelfth lamp of a grid of 12 x 12 belongs to one column, which lies in a plane with the object.
TEST(LightChoice, LampsFarApartTellNormalsWhateverTheirOrder) {
  std::vector<Vec3<double>> rows;
  for (int y = 0; y < 12; ++y)
    for (int x = -6; x < 6; ++x)
      rows.push_back(Vec3<double>(0.1 * x, 0.1 * (y - 6), 1).normalized()); // every twelfth has one x
  std::vector<size_t> everyTwelfth;
  for (size_t i = 6; i < rows.size(); i += 12) everyTwelfth.push_back(i);
  ASSERT_FALSE(tellNormals(of(rows, everyTwelfth)));
  const std::vector<size_t> chosen = farApart(rows, 12);
  EXPECT_EQ(std::set(chosen.begin(), chosen.end()).size(), 12u);
  EXPECT_TRUE(tellNormals(of(rows, chosen)));
}

// [Gonzalez 1985]: no lamp is farther from the chosen ones than they are from each other.
TEST(LightChoice, LampsFarApartLeaveNoneFartherThanTheyAre) {
  const std::vector<Vec3<double>> all = domeOfArcs(12, 5);
  const std::vector<Vec3<double>> chosen = of(all, farApart(all, 12));
  double apart = 2, farthest = 0;
  for (size_t a = 0; a < chosen.size(); ++a)
    for (size_t b = 0; b < a; ++b) apart = std::min(apart, (chosen[a] - chosen[b]).norm());
  for (const Vec3<double>& lamp : all) {
    double nearest = 2;
    for (const Vec3<double>& other : chosen) nearest = std::min(nearest, (lamp - other).norm());
    farthest = std::max(farthest, nearest);
  }
  EXPECT_LE(farthest, apart);
}

TEST(LightChoice, LampsAtOnePlaceAreChosenOnceEach) {
  const std::vector<Vec3<double>> all(5, Vec3<double>(0, 0, 1));
  EXPECT_EQ(farApart(all, 3).size(), 3u);
  EXPECT_EQ(farApart(all, 9), (std::vector<size_t>{0, 1, 2, 3, 4}));
}

TEST(LightChoice, ChoicesWithoutPeriodMeetEachRingOfADome) {
  for (const size_t anArc : {2u, 3u, 4u, 5u, 6u}) {
    std::set<size_t> rings;
    const std::vector<size_t> chosen = withoutPeriod(12 * anArc, 12);
    EXPECT_EQ(chosen.size(), 12u);
    for (const size_t l : chosen) rings.insert(l % anArc);
    EXPECT_EQ(rings.size(), anArc);
  }
  EXPECT_EQ(withoutPeriod(4, 12), (std::vector<size_t>{0, 1, 2, 3}));
}

} // namespace
} // namespace surflect::planes
