#include "render/lightfield/slf/stretch.h"

#include "tests/render/lightfield/slf/meshes.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace surflect::slf {
namespace {

Vec2<double> randomPoint(std::mt19937& random) {
  std::uniform_real_distribution<double> number(-1, 1);
  const double x = number(random), y = number(random);
  return {x, y};
}

TEST(Stretch, MetricIsThatOfTheAffineMap) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 200; ++trial) {
    Eigen::Matrix<double, 3, 2> map;
    map << randomUnit(random), randomUnit(random);
    const Vec3<double> origin = 10 * randomUnit(random);
    std::array<Vec2<double>, 3> p;
    std::array<Vec3<double>, 3> q;
    for (size_t k = 0; k < 3; ++k) p[k] = randomPoint(random), q[k] = origin + map * p[k];
    if (std::abs(planeArea(p[0], p[1], p[2])) < 0.05) continue;
    const Metric metric = metricOf(q, p);
    const Eigen::Matrix2d gram = map.transpose() * map;
    EXPECT_NEAR(metric.a, gram(0, 0), 1e-12);
    EXPECT_NEAR(metric.b, gram(0, 1), 1e-12);
    EXPECT_NEAR(metric.c, gram(1, 1), 1e-12);
    const Eigen::JacobiSVD<Eigen::Matrix<double, 3, 2>> svd(map);
    EXPECT_NEAR(metric.largest(), svd.singularValues()[0], 1e-7);
    EXPECT_NEAR(metric.meanSquare(), svd.singularValues().squaredNorm() / 2, 1e-12);
  }
}

TEST(Stretch, SumsOfARectangle) {
  // A rectangle of 3 x 2 over the unit square.
  const std::vector<Vec3<double>> positions = {{0, 0, 0}, {3, 0, 0}, {3, 0, 2}, {0, 0, 2}};
  const std::vector<Vec2<double>> coordinates = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  std::vector<std::array<uint32_t, 3>> triangles = {{0, 1, 2}, {0, 2, 3}};
  StretchSums sums = stretchSums(positions, triangles, coordinates);
  EXPECT_DOUBLE_EQ(sums.a, 6 * 9);
  EXPECT_DOUBLE_EQ(sums.c, 6 * 4);
  EXPECT_DOUBLE_EQ(sums.area, 6);
  EXPECT_DOUBLE_EQ(sums.planeArea, 1);
  EXPECT_DOUBLE_EQ(sums.bestAspect(), 1.5);
  EXPECT_DOUBLE_EQ(sums.leastStretch(), 2 * 6 * 6); // 2 area^2: no stretch
  triangles[1] = {0, 3, 2};
  sums = stretchSums(positions, triangles, coordinates);
  EXPECT_TRUE(std::isinf(sums.leastStretch()));
}

TEST(Stretch, LeastStretchIsThatOfTheBestAspect) {
  const StretchSums sums{5, 0.7, 1, 1};
  const auto stretchAt = [&](double aspect) { return sums.a / aspect + sums.c * aspect; };
  EXPECT_NEAR(sums.leastStretch(), stretchAt(sums.bestAspect()), 1e-12);
  EXPECT_LT(sums.leastStretch(), stretchAt(sums.bestAspect() * 1.01));
  EXPECT_LT(sums.leastStretch(), stretchAt(sums.bestAspect() / 1.01));
}

} // namespace
} // namespace surflect::slf
