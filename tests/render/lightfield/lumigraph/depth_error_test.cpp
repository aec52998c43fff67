#include "render/lightfield/lumigraph/depth_error.h"

#include "render/lightfield/lumigraph/slab.h"
#include "tests/render/lightfield/lumigraph/synthetic_lumigraph.h"

#include <algorithm>
#include <cmath>
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

// A square plate, and the same plate moved down: lines meet both where planes are crossed within the squares.
TEST(DepthErrors, OfAPlateThatIsMovedAreThoseOfPlanes) {
  constexpr float kMoved = 0.1f;
  const auto plateAt = [](float z) {
    return TriangleMesh{{{-1, -1, z}, {1, -1, z}, {1, 1, z}, {-1, 1, z}}, {{0, 1, 2}, {0, 2, 3}}};
  };
  const Slabs slabs = slabsAround(bumpySphere(0), {.nodes = 3, .texels = 20000, .distance = 4});
  const DepthErrors errors = depthErrors(slabs, RayCaster<AcquisitionSpace>(plateAt(0)), plateAt(-kMoved), 2);
  size_t lines = 0;
  double depth = 0, offset = 0, worstDepth = 0, worstOffset = 0;
  for (const Slab& slab : slabs)
    for (int node = 0; node < 9; ++node)
      for (int y = 1; y < slab.height; y += 2)
        for (int x = 1; x < slab.width; x += 2) {
          const Line line = slab.lineOf({double(node % 3), double(node / 3), x + 0.5, y + 0.5});
          const Vec3<double> o = line.origin.raw(), r = line.direction.raw();
          const auto reach = [&](double z) { return (z - o[2]) / r[2]; };
          const auto isWithin = [&](double z) {
            return reach(z) > 0 && (o + reach(z) * r).head<2>().cwiseAbs().maxCoeff() < 1;
          };
          if (r[2] == 0 || !isWithin(0) || !isWithin(-kMoved)) continue;
          const double d = reach(0) * std::abs(r[slab.axis]), e = reach(-kMoved) * std::abs(r[slab.axis]) - d;
          const double ghost =
              std::abs(ghostOffset(std::abs(slab.stPlane - slab.uvPlane), e,
                                   std::max(slab.stSpacing[0], slab.stSpacing[1]), d, slab.uvSpacing));
          ++lines, depth += std::abs(e), offset += ghost;
          worstDepth = std::max(worstDepth, std::abs(e)), worstOffset = std::max(worstOffset, ghost);
        }
  EXPECT_GT(lines, 500u);
  EXPECT_EQ(errors.lines, lines);
  EXPECT_NEAR(errors.meanDepth, depth / double(lines), 1e-5);
  EXPECT_NEAR(errors.worstDepth, worstDepth, 1e-5);
  EXPECT_NEAR(errors.meanOffset, offset / double(lines), 1e-4);
  EXPECT_NEAR(errors.worstOffset, worstOffset, 1e-4);
}

TEST(DepthErrors, OfTheObjectItselfAreNone) {
  const TriangleMesh object = bumpySphere(0.3);
  const DepthErrors errors = depthErrors(slabsAround(object, {.nodes = 2, .texels = 20000}),
                                         RayCaster<AcquisitionSpace>(object), object, 3);
  EXPECT_GT(errors.lines, 500u);
  EXPECT_EQ(errors.worstOffset, 0);
}

} // namespace
} // namespace surflect::lumigraph
