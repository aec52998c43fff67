#include "render/lightfield/slf/square_border.h"

#include "render/lightfield/slf/disc.h"
#include "render/lightfield/slf/plane_border.h"
#include "render/lightfield/slf/triangle_graph.h"
#include "tests/render/lightfield/slf/meshes.h"
#include "tests/render/lightfield/slf/whole_disc.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::slf {
namespace {

using namespace testing;

TEST(SquareBorder, IsStrictlyConvexWithinTheSquareAndTouchesItsSides) {
  const Disc disc = wholeOf(shaken(squarePatch(9), 0.03f, 1));
  const size_t n = disc.border.size();
  for (const SquareShape& shape : {SquareShape{0.02, 0}, SquareShape{0.02, 1}, SquareShape{0.15, 0.5}}) {
    const std::vector<Vec2<double>> p = squareBorder(disc, {3, 10, 20, 31}, shape);
    double area = 0;
    for (size_t i = 0; i < n; ++i) {
      EXPECT_GT(planeArea(p[i], p[(i + 1) % n], p[(i + 2) % n]), 0);
      EXPECT_TRUE((p[i].array() >= 0).all() && (p[i].array() <= 1).all());
      area += planeArea({0, 0}, p[i], p[(i + 1) % n]);
    }
    const double s = shape.bulge, inner = 1 - 2 * s;
    const double exact = inner * inner + 4 * 2.0 / 3 * s * inner; // with a parabola on each side
    EXPECT_LT(area, exact);
    EXPECT_GT(area, exact - 0.02 * s * 4);
    EXPECT_LT((p[3] - Vec2<double>(s, s)).norm(), 1e-15);
    EXPECT_LT((p[20] - Vec2<double>(1 - s, 1 - s)).norm(), 1e-15);
  }
}

TEST(SquareBorder, IsStrictlyConvexUpToABulgeOfASixth) {
  const Disc disc = wholeOf(squarePatch(200));
  const size_t n = disc.border.size();
  for (const double bulge : {1e-3, 0.1, 0.165}) {
    const std::vector<Vec2<double>> p = squareBorder(disc, {0, 200, 400, 600}, {bulge});
    for (size_t i = 0; i < n; ++i) EXPECT_GT(planeArea(p[i], p[(i + 1) % n], p[(i + 2) % n]), 0) << bulge;
  }
  // Beside a corner, the border turns less and less.
  const auto turnAtCorner = [&](double bulge) {
    const std::vector<Vec2<double>> p = squareBorder(disc, {0, 200, 400, 600}, {bulge});
    return planeArea(p[199], p[200], p[201]) / ((p[200] - p[199]).norm() * (p[201] - p[200]).norm());
  };
  EXPECT_GT(turnAtCorner(0.02), 0.45);
  EXPECT_LT(turnAtCorner(0.165), 0.02);
}

TEST(SquareBorder, SpacesVerticesByTheirDistances) {
  const Disc disc = wholeOf(shaken(squarePatch(9), 0.03f, 1));
  const std::vector<Vec2<double>> p = squareBorder(disc, {0, 9, 18, 27});
  const auto length = [&](size_t from, size_t to) {
    double sum = 0;
    for (size_t i = from; i < to; ++i)
      sum += (disc.positions[disc.border[i + 1]] - disc.positions[disc.border[i]]).norm();
    return sum;
  };
  for (size_t i = 0; i < 9; ++i) EXPECT_NEAR((p[i].x() - 0.02) / 0.96, length(0, i) / length(0, 9), 1e-12);
}

} // namespace
} // namespace surflect::slf
