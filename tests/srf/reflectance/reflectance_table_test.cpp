#include "srf/reflectance/reflectance_table.h"

#include "tests/srf/reflectance/planted.h"

#include <gtest/gtest.h>

#include <numeric>

namespace surflect::reflectance {
namespace {

const TableGrid kGrid;
const TableGrid kSmall{{9, 7, 5, 3}};

std::vector<Rgb> randomNodes(const TableGrid& grid, std::mt19937& random) {
  std::uniform_real_distribution<float> value(0, 2);
  std::vector<Rgb> nodes;
  for (uint32_t node = 0; node < grid.size(); ++node) {
    const float r = value(random), g = value(random), b = value(random);
    nodes.push_back({r, g, b});
  }
  return nodes;
}

HalfDifference<double> exact(const HalfDifference<>& at) {
  return {at.halfU, at.halfV, at.differenceU, at.differenceV};
}

TEST(ReflectanceTable, ANodeAndItsMirrorImageAreStoredOnce) {
  EXPECT_EQ(kGrid.size(), 545u * 49u);
  std::vector<int> uses(kGrid.size());
  for (uint32_t i = 0; i < 33; ++i)
    for (uint32_t j = 0; j < 33; ++j) {
      const uint32_t node = kGrid.indexOf(i * 33 + j, 0);
      EXPECT_EQ(node, kGrid.indexOf((32 - i) * 33 + 32 - j, 0));
      ++uses[node];
    }
  EXPECT_EQ(std::ranges::count(uses, 2), 544); // and the middle once
  EXPECT_EQ(std::ranges::count(uses, 1), 1);
}

TEST(ReflectanceTable, WeightsOfCornersSumToOneAndAreNotNegative) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 1000; ++trial) {
    const auto at = halfDifference(planted::above(random, -1), planted::above(random, -1));
    const TableCorners corners = cornersOf(kGrid, placeOf(kGrid, at));
    EXPECT_NEAR(std::accumulate(corners.weight.begin(), corners.weight.end(), 0.0), 1, 1e-6);
    EXPECT_GE(*std::ranges::min_element(corners.weight), 0);
    EXPECT_LT(*std::ranges::max_element(corners.index), kGrid.size());
  }
}

TEST(ReflectanceTable, LookUpIsThatOfTheWholeGridInDoublePrecision) {
  std::mt19937 random(2);
  const auto nodes = randomNodes(kSmall, random);
  for (int trial = 0; trial < 300; ++trial) {
    const auto at = halfDifference(planted::above(random, -1), planted::above(random, -1));
    const Rgb got = lookUpNodes(kSmall, nodes, placeOf(kSmall, at));
    const auto wanted = lookUpReference(kSmall, nodes, exact(at));
    EXPECT_NEAR(got.r, wanted[0], 1.5e-6);
    EXPECT_NEAR(got.g, wanted[1], 1.5e-6);
    EXPECT_NEAR(got.b, wanted[2], 1.5e-6);
  }
}

TEST(ReflectanceTable, ANodeAnswersAtItsOwnPlace) {
  std::mt19937 random(3);
  const auto nodes = randomNodes(kSmall, random);
  const float a = 0.5f, p = a / (3 - 2 * a); // the seventh of nine
  EXPECT_EQ(lookUpNodes(kSmall, nodes, placeOf(kSmall, {p, 0, 0.5f, 1})),
            nodes[kSmall.indexOf(6 * 7 + 3, 3 * 3 + 2)]);
  EXPECT_EQ(lookUpNodes(kSmall, nodes, placeOf(kSmall, {0, 0, 0, 0})),
            nodes[kSmall.indexOf(4 * 7 + 3, 2 * 3 + 1)]);
}

TEST(ReflectanceTable, MirrorImagesGiveTheSameBits) {
  std::mt19937 random(4);
  const auto nodes = randomNodes(kGrid, random);
  for (int trial = 0; trial < 1000; ++trial) {
    auto at = halfDifference(planted::above(random), planted::above(random));
    if (trial % 4 == 0) at.halfU = 0;
    const HalfDifference<> mirrored{-at.halfU, -at.halfV, at.differenceU, at.differenceV};
    EXPECT_EQ(lookUpNodes(kGrid, nodes, placeOf(kGrid, at)),
              lookUpNodes(kGrid, nodes, placeOf(kGrid, mirrored)));
  }
}

// Straight through cells, across the mirror line p_u = 0, the mirror direction p = 0, e = 0, and out of the
// grid.
TEST(ReflectanceTable, IsContinuousAlongPaths) {
  std::mt19937 random(5);
  const auto nodes = randomNodes(kGrid, random);
  std::uniform_real_distribution<float> any(-1, 1);
  const auto walk = [&](const HalfDifference<>& from, const HalfDifference<>& to) {
    constexpr int kSteps = 20000;
    float jump = 0, before = 0;
    for (int step = 0; step <= kSteps; ++step) {
      const float t = static_cast<float>(step) / kSteps;
      const auto between = [t](float a, float b) { return (1 - t) * a + t * b; };
      const HalfDifference<> at{between(from.halfU, to.halfU), between(from.halfV, to.halfV),
                                between(from.differenceU, to.differenceU),
                                between(from.differenceV, to.differenceV)};
      const float now = lookUpNodes(kGrid, nodes, placeOf(kGrid, at)).r;
      if (step > 0) jump = std::max(jump, std::abs(now - before));
      before = now;
    }
    return jump;
  };
  // A step crosses up to 1/200 of a cell along p, between nodes that differ by up to 2.
  constexpr float kMost = 0.03f;
  for (int trial = 0; trial < 20; ++trial) {
    const HalfDifference<> from{any(random), any(random), any(random), any(random)};
    const HalfDifference<> to{any(random), any(random), any(random), any(random)};
    EXPECT_LT(walk(from, to), kMost);
    EXPECT_LT(walk(from, {-from.halfU, -from.halfV, -from.differenceU, -from.differenceV}), kMost);
    EXPECT_LT(walk({-0.1f, from.halfV, 0, 0}, {0.1f, from.halfV, 0, 0}), kMost);
    EXPECT_LT(walk(from, {1.5f, to.halfV, -1.5f, 0}), kMost);
  }
}

struct Queries {
  std::vector<Direction3<SurfelSpace>> view, light;

  std::vector<Rgb> answers(const ReflectanceTables& tables) const {
    std::vector<Rgb> all(view.size());
    predictReflectance(tables, {{1, 0, 1}, {0.5f, 0.25f, 0.25f}}, view, light, all);
    return all;
  }
};

Queries randomQueries(size_t count, std::mt19937& random) {
  Queries queries;
  for (size_t q = 0; q < count; ++q) {
    queries.view.push_back(planted::above(random));
    queries.light.push_back(planted::above(random));
  }
  return queries;
}

TEST(ReflectanceTables, AnswersAreThoseOfTheDefinitionUpToHalfFloats) {
  std::mt19937 random(6);
  const auto first = randomNodes(kSmall, random), second = randomNodes(kSmall, random);
  ReflectanceTables tables{kSmall, {}};
  tables.add(first);
  tables.add(second);
  EXPECT_EQ(tables.count(), 2u);
  const Queries queries = randomQueries(200, random);
  const std::vector<Rgb> answers = queries.answers(tables);
  for (size_t q = 0; q < answers.size(); ++q) {
    const auto v = queries.view[q].cast<double>(), l = queries.light[q].cast<double>();
    const auto at = halfDifference(v, l);
    const double table =
        0.25 * lookUpReference(kSmall, first, at)[1] + 0.75 * lookUpReference(kSmall, second, at)[1];
    const double wanted = tableLink(l.z(), v.z()) * table;
    EXPECT_NEAR(answers[q].g, wanted, 1e-3 * wanted);
  }
}

TEST(ReflectanceTables, ReflectanceIsReciprocal) {
  std::mt19937 random(7);
  ReflectanceTables tables{kGrid, {}};
  tables.add(randomNodes(kGrid, random));
  tables.add(randomNodes(kGrid, random));
  Queries queries = randomQueries(500, random);
  const std::vector<Rgb> there = queries.answers(tables);
  std::swap(queries.view, queries.light);
  const std::vector<Rgb> back = queries.answers(tables);
  for (size_t q = 0; q < there.size(); ++q) // view and light are exchanged by now
    EXPECT_NEAR(there[q].r / queries.view[q].z(), back[q].r / queries.light[q].z(),
                1e-6f * there[q].r / queries.view[q].z());
}

TEST(ReflectanceTables, NothingIsNegativeAndNothingOverflows) {
  std::mt19937 random(8);
  ReflectanceTables tables{kSmall, {}};
  tables.add(std::vector<Rgb>(kSmall.size(), Rgb{-1, 1e9f, 0}));
  tables.add(std::vector<Rgb>(kSmall.size(), Rgb{-1, 1e9f, 0}));
  for (const Rgb& answer : randomQueries(50, random).answers(tables)) {
    EXPECT_EQ(answer.r, 0);
    EXPECT_TRUE(std::isfinite(answer.g));
    EXPECT_EQ(answer.b, 0);
  }
}

// A table below 0 adds nothing, as where gains are found (shared_table.h).
TEST(ReflectanceTables, AMixtureTakesNothingFromATableBelowZero) {
  std::mt19937 random(9);
  ReflectanceTables tables{kSmall, {}};
  tables.add(std::vector<Rgb>(kSmall.size(), Rgb{-1, -1, -1}));
  tables.add(std::vector<Rgb>(kSmall.size(), Rgb{1, 1, 1}));
  const Queries queries = randomQueries(50, random); // a quarter of the first table
  const std::vector<Rgb> answers = queries.answers(tables);
  for (size_t q = 0; q < answers.size(); ++q)
    EXPECT_NEAR(answers[q].g, 0.75f * tableLink(queries.light[q].z(), queries.view[q].z()), 1e-5);
}

} // namespace
} // namespace surflect::reflectance
