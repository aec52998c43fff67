#include "render/lightfield/lumigraph/depth_error.h"

#include "render/lightfield/lumigraph/slab.h"
#include "tests/render/lightfield/lumigraph/synthetic_lumigraph.h"

#include <random>

namespace surflect::lumigraph {
namespace {

// A line from node A meets the object at depth d, but is corrected for depth d + e: node B is then asked
// where its line to the wrong point crosses the uv plane, and shows another point.
TEST(DepthError, IsTheOffsetOfIntersectedRays) {
  std::mt19937 random(1);
  for (const Slab& slab : slabsAround(bumpySphere(0.3), {.nodes = 4, .texels = 100000, .distance = 3}))
    for (int n = 0; n < 50; ++n) {
      std::uniform_real_distribution<double> within(0, 1);
      const double p = std::abs(slab.stPlane - slab.uvPlane);
      const double d = p + within(random) - 0.5, e = 0.2 * (within(random) - 0.5);
      const Line a = slab.lineOf({1, 2, slab.width * within(random), slab.height * within(random)});
      const double slant = std::abs(a.direction.raw()[slab.axis]); // depth along the line, per length
      const Point truth = a.origin + d / slant * a.direction;
      const Point wrong = a.origin + (d + e) / slant * a.direction;
      const Point b = slab.stPoint(2, 2);
      const double shown = slab.coordinatesOf(truth, b).u, asked = slab.coordinatesOf(wrong, b).u;
      EXPECT_NEAR(asked - shown, ghostOffset(p, e, slab.stSpacing[0], d, slab.uvSpacing), 1e-9);
      EXPECT_NEAR(slab.coordinatesOf(truth, a.origin).u, slab.coordinatesOf(wrong, a.origin).u, 1e-9);
    }
}

TEST(DepthError, GrowsWithTheRatioOfGridSpacings) {
  EXPECT_DOUBLE_EQ(ghostOffset(4, 0.1, 2, 3, 0.01), 2 * ghostOffset(4, 0.1, 1, 3, 0.01));
  EXPECT_DOUBLE_EQ(ghostOffset(4, 0.1, 2, 3, 0.01), 2 * ghostOffset(4, 0.1, 2, 3, 0.02));
  EXPECT_EQ(ghostOffset(4, 0, 2, 3, 0.01), 0);
}

} // namespace
} // namespace surflect::lumigraph
