#include "srf/reflectance/table_fit.h"

#include "tests/srf/reflectance/planted.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <functional>

namespace surflect::reflectance {
namespace {

// Photographs of a field of table values, one a channel.
struct Measured {
  std::vector<HalfDifference<>> directions;
  std::vector<TablePlace> places;
  std::vector<Rgb> values, factors;
  std::vector<float> weights;

  FitSamples samples() const { return {places, values, factors, weights}; }
};

using Field = std::function<Rgb(const HalfDifference<>&)>;

Measured measured(const TableGrid& grid, const Field& field, size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> factor(0.5f, 2);
  Measured all;
  for (size_t i = 0; i < count; ++i) {
    const auto view = planted::above(random, 0), light = planted::above(random, 0);
    const float r = factor(random), g = factor(random), b = factor(random);
    all.directions.push_back(halfDifference(view, light));
    all.places.push_back(placeOf(grid, all.directions[i]));
    all.factors.push_back({r, g, b});
    all.values.push_back(all.factors[i] * field(all.directions[i]));
    all.weights.push_back(factor(random));
  }
  return all;
}

double rootMeanSquare(const TableGrid& grid, const std::vector<Rgb>& nodes, const Field& field,
                      unsigned seed) {
  std::mt19937 random(seed);
  double sum = 0;
  constexpr int kCount = 4000;
  for (int i = 0; i < kCount; ++i) {
    const auto view = planted::above(random, 0.05), light = planted::above(random, 0.05);
    const auto at = halfDifference(view, light);
    const Rgb got = lookUpNodes(grid, nodes, placeOf(grid, at)), wanted = field(at);
    sum += (got.r - wanted.r) * (got.r - wanted.r) + (got.b - wanted.b) * (got.b - wanted.b);
  }
  return std::sqrt(sum / (2 * kCount));
}

Rgb smoothField(const HalfDifference<>& at) {
  const float p = at.halfU * at.halfU + at.halfV * at.halfV;
  return {std::exp(-4 * p), std::exp(-p) * (1 + 0.5f * at.differenceU), 1 / (1 + 3 * at.halfU * at.halfU)};
}

TEST(TableFit, IsTheSolutionOfTheDenseSystem) {
  const TableGrid grid{{7, 5, 3, 3}};
  const Measured some = measured(grid, smoothField, 150, 1);
  const FitOptions options{.white = 0.4f, .tolerance = 1e-9, .mostIterations = 2000};
  const auto fitted = fitTable(grid, some.samples(), options);
  const auto wanted = fitTableReference(grid, some.samples(), options);
  ASSERT_EQ(fitted.size(), grid.size());
  for (size_t node = 0; node < fitted.size(); ++node) {
    EXPECT_NEAR(fitted[node].r, wanted[node].r, 1e-6); // single precision
    EXPECT_NEAR(fitted[node].g, wanted[node].g, 1e-6);
    EXPECT_NEAR(fitted[node].b, wanted[node].b, 1e-6);
  }
}

FitOptions hardlySmoothed(double smooth) {
  return {.smoothHalf = smooth,
          .smoothDifference = smooth,
          .ridge = 1e-9,
          .tolerance = 1e-8,
          .mostIterations = 2000};
}

TEST(TableFit, ReproducesAFieldOfTheGrid) {
  const TableGrid grid{{9, 9, 3, 3}};
  std::mt19937 random(2);
  std::uniform_real_distribution<float> value(0, 2);
  std::vector<Rgb> planted(grid.size());
  for (Rgb& node : planted) node = {value(random), value(random), value(random)};
  const Field field = [&](const HalfDifference<>& at) {
    return lookUpNodes(grid, planted, placeOf(grid, at));
  };
  const Measured many = measured(grid, field, 20000, 3);
  const auto fitted = fitTable(grid, many.samples(), hardlySmoothed(1e-7));
  EXPECT_LT(rootMeanSquare(grid, fitted, field, 4), 1.2e-5);
}

// Second differences of an even field are 0, those of one that is linear in e as well: smoothing does not
// bend them, and continues them to where no photograph is.
TEST(TableFit, SmoothingKeepsWhatIsLinearInTheDifferenceVector) {
  const TableGrid grid{{9, 9, 5, 5}};
  const Field field = [](const HalfDifference<>& at) {
    return Rgb{0.7f, 1 + 0.5f * at.differenceU, 1 - 0.3f * at.differenceV};
  };
  const Measured few = measured(grid, field, 60, 5);
  const auto fitted = fitTable(
      grid, few.samples(),
      {.smoothHalf = 1, .smoothDifference = 1, .ridge = 1e-9, .tolerance = 1e-9, .mostIterations = 3000});
  EXPECT_LT(rootMeanSquare(grid, fitted, field, 6), 1e-6);
}

TEST(TableFit, ConvergesToASmoothFieldAsTheGridIsRefined) {
  double before = 0.03;
  for (const uint32_t nodes : {9u, 17u, 33u}) {
    const TableGrid grid{{nodes, nodes, 3, 3}};
    const Field field = [](const HalfDifference<>& at) {
      const float p = at.halfU * at.halfU + at.halfV * at.halfV;
      return Rgb{std::exp(-4 * p), 0, std::exp(-2 * at.halfU * at.halfU)};
    };
    const Measured many = measured(grid, field, 30000, 7);
    const auto fitted = fitTable(grid, many.samples(), hardlySmoothed(1e-5));
    const double error = rootMeanSquare(grid, fitted, field, 8);
    EXPECT_LT(error, before / 2.5) << nodes; // second order: a quarter in the limit
    before = error;
  }
  EXPECT_LT(before, 1e-3);
}

TEST(TableFit, GivesTheSameBitsForAnyNumberOfThreads) {
  const TableGrid grid{{17, 17, 5, 5}};
  const Measured some = measured(grid, smoothField, 5000, 9);
  const auto many = fitTable(grid, some.samples(), {});
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(fitTable(grid, some.samples(), {}), many);
}

TEST(TableFit, OfNoPhotographIsZero) {
  const TableGrid grid{{5, 5, 3, 3}};
  for (const Rgb& node : fitTable(grid, {}, {})) EXPECT_EQ(node, Rgb{});
}

TEST(TableFit, CanBeCancelled) {
  const TableGrid grid{{5, 5, 3, 3}};
  const Measured some = measured(grid, smoothField, 100, 10);
  EXPECT_THROW(fitTable(grid, some.samples(), {}, {}, {{}, [] { return true; }}), Cancelled);
}

} // namespace
} // namespace surflect::reflectance
