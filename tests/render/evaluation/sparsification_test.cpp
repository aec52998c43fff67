#include "render/evaluation/sparsification.h"

#include <gtest/gtest.h>

#include <cmath>

namespace surflect::evaluation {
namespace {

const std::vector<double> errorOfPart{3, 1, 4, 1, 5, 9, 2, 6, 5, 3};

std::vector<double> scaled(std::vector<double> values, double factor) {
  for (double& value : values) value *= factor;
  return values;
}

TEST(Sparsification, BeginsWithTheErrorOfAllParts) {
  double sum = 0;
  for (const double e : errorOfPart) sum += e * e;
  const Sparsification curves = sparsify(errorOfPart, scaled(errorOfPart, -1), 5);
  EXPECT_DOUBLE_EQ(curves.best[0], std::sqrt(sum / 10));
  EXPECT_DOUBLE_EQ(curves.byPrediction[0], curves.best[0]);
}

// Half of the parts taken away leaves the errorOfPart 1, 1, 2, 3, 3.
TEST(Sparsification, ThatOfAPerfectOrderIsTheBestAndFalls) {
  const Sparsification curves = sparsify(errorOfPart, scaled(errorOfPart, 0.1), 10);
  for (size_t step = 0; step < 10; ++step)
    EXPECT_DOUBLE_EQ(curves.byPrediction[step], curves.best[step]) << step;
  for (size_t step = 1; step < 10; ++step) EXPECT_LE(curves.best[step], curves.best[step - 1]) << step;
  EXPECT_DOUBLE_EQ(curves.best[5], std::sqrt(24 / 5.0));
  EXPECT_DOUBLE_EQ(sparsificationError(curves), 0);
}

TEST(Sparsification, AReversedOrderRisesAboveEveryOther) {
  const Sparsification reversed = sparsify(errorOfPart, scaled(errorOfPart, -1), 10),
                       other = sparsify(errorOfPart, std::vector<double>{2, 7, 1, 8, 2, 8, 1, 8, 2, 8}, 10);
  EXPECT_DOUBLE_EQ(reversed.byPrediction[9], 9);
  EXPECT_GT(sparsificationError(reversed), sparsificationError(other));
  EXPECT_GT(sparsificationError(other), 0);
}

TEST(Sparsification, AConstantPredictionLeavesAFlatCurve) {
  for (const double left : sparsify(errorOfPart, std::vector<double>(10, 0.5), 10).byPrediction)
    EXPECT_NEAR(left, std::sqrt(207 / 10.0), 1e-12);
}

TEST(Sparsification, NothingIsLeftOfNothing) {
  EXPECT_TRUE(sparsify({}, {}, 10).best.empty());
  EXPECT_EQ(sparsificationError(sparsify({}, {}, 10)), 0);
  EXPECT_EQ(sparsificationError(sparsify(std::vector<double>{0, 0}, std::vector<double>{1, 2}, 2)), 0);
}

} // namespace
} // namespace surflect::evaluation
