#include "render/lightfield/slf/disc.h"

#include "render/lightfield/slf/triangle_graph.h"
#include "tests/render/lightfield/slf/meshes.h"
#include "tests/render/lightfield/slf/whole_disc.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

namespace surflect::slf {
namespace {

using namespace testing;

TEST(Disc, BorderOfAPatchGoesRoundCounterClockwise) {
  const TriangleMesh mesh = squarePatch(7);
  const std::optional<Disc> disc = discOfAll(mesh);
  ASSERT_TRUE(disc);
  ASSERT_EQ(disc->border.size(), 28u);
  double twiceArea = 0;
  for (size_t i = 0; i < disc->border.size(); ++i) {
    const Vec3<double>&a = disc->positions[disc->border[i]], &b = disc->positions[disc->border[(i + 1) % 28]];
    EXPECT_NEAR((b - a).norm(), 1 / 7.0, 1e-7);
    twiceArea += a.cross(b).z();
  }
  EXPECT_NEAR(twiceArea, 2, 1e-6);
}

TEST(Disc, CornersAndPositionsAreThoseOfTheMesh) {
  const TriangleMesh mesh = bumpySphere(8, 9);
  const std::optional<Disc> disc = discOf(mesh, triangleGraph(mesh), std::vector<uint32_t>{2, 3});
  ASSERT_TRUE(disc);
  EXPECT_EQ(disc->meshTriangles, (std::vector<uint32_t>{2, 3}));
  for (size_t t = 0; t < 2; ++t)
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t v = disc->triangles[t][k];
      EXPECT_EQ(disc->vertices[v], mesh.triangles[disc->meshTriangles[t]][k]);
      EXPECT_EQ(disc->positions[v], mesh.positions[disc->vertices[v]].cast<double>().raw());
    }
}

TEST(Disc, OtherSurfacesAreNone) {
  EXPECT_FALSE(discOfAll(bumpySphere(5, 6)));                        // closed
  EXPECT_FALSE(discOfAll(torus(5, 6)));                              // closed, with a handle
  EXPECT_FALSE(discOfAll(together(squarePatch(2), squarePatch(2)))); // on one place: edges of four triangles
  TriangleMesh handle = torus(5, 6);
  handle.triangles.pop_back();
  EXPECT_FALSE(discOfAll(handle)); // one border, with a handle
  TriangleMesh ring = squarePatch(3);
  std::swap(ring.triangles[8], ring.triangles[17]);
  std::swap(ring.triangles[9], ring.triangles[16]);
  ring.triangles.resize(16);
  EXPECT_FALSE(discOfAll(ring));
  TriangleMesh apart = squarePatch(3);
  apart.triangles = {apart.triangles[0], apart.triangles[17]};
  EXPECT_FALSE(discOfAll(apart));
  TriangleMesh pinched = squarePatch(2);
  pinched.triangles = {pinched.triangles[0], pinched.triangles[1], pinched.triangles[6],
                       pinched.triangles[7]};
  EXPECT_FALSE(discOfAll(pinched));
}

TEST(Disc, ATriangleIsADisc) {
  EXPECT_TRUE(discOfAll(meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}})));
}

TEST(Disc, NoTrianglesAreNone) { EXPECT_FALSE(discOfAll({})); }

using Loop = std::vector<uint32_t>;

// Union with no pinched place; checks that scratch memory is left clean.
Loop united(const Loop& a, const Loop& b, size_t sharedEdges, std::vector<uint8_t> isPinched = {}) {
  isPinched.resize(20, 0);
  std::vector<uint32_t> order(20, 0);
  const Loop loop = unitedLoop(a, b, sharedEdges, isPinched, order);
  EXPECT_EQ(std::ranges::count(order, 0u), 20);
  return loop;
}

// Loop that starts at its lowest place.
Loop rotated(Loop loop) {
  std::ranges::rotate(loop, std::ranges::min_element(loop));
  return loop;
}

TEST(DiscBorders, LoopsUniteAlongOnePathWhereverTheyStart) {
  for (size_t i = 0; i < 5; ++i)
    for (size_t j = 0; j < 4; ++j) {
      Loop a = {0, 1, 2, 3, 4}, b = {3, 2, 1, 5};
      std::ranges::rotate(a, a.begin() + static_cast<ptrdiff_t>(i));
      std::ranges::rotate(b, b.begin() + static_cast<ptrdiff_t>(j));
      EXPECT_EQ(rotated(united(a, b, 2)), (Loop{0, 1, 5, 3, 4}));
      EXPECT_EQ(rotated(united(b, a, 2)), (Loop{0, 1, 5, 3, 4}));
    }
}

TEST(DiscBorders, TrianglesUniteToAQuadrangle) {
  EXPECT_EQ(rotated(united({0, 1, 2}, {2, 1, 3}, 1)), (Loop{0, 1, 3, 2}));
}

TEST(DiscBorders, ATriangleFillsANotchOfTwoEdges) {
  EXPECT_EQ(rotated(united({0, 1, 2, 3}, {2, 1, 0}, 2)), (Loop{0, 2, 3}));
}

TEST(DiscBorders, LoopsThatTouchAtAFurtherPlaceStayApart) {
  EXPECT_TRUE(united({0, 1, 2, 3, 4}, {2, 1, 5, 4}, 1).empty()); // would be a ring, or pinched at 4
}

TEST(DiscBorders, LoopsThatShareTwoPathsStayApart) {
  EXPECT_TRUE(united({0, 1, 2, 3, 4, 5}, {1, 0, 4, 3}, 2).empty());
}

TEST(DiscBorders, ClosedSurfacesStayOpen) {
  EXPECT_TRUE(united({0, 1, 2}, {2, 1, 0}, 3).empty());
  EXPECT_TRUE(united({0, 1, 2}, {2, 1, 0}, 2).empty()); // the third edge is not shared, but has the same ends
}

TEST(DiscBorders, PinchedPlacesStayOnTheBorder) {
  EXPECT_TRUE(united({0, 1, 2, 3, 4}, {3, 2, 1, 5}, 2, {0, 0, 1}).empty());
  EXPECT_FALSE(united({0, 1, 2, 3, 4}, {3, 2, 1, 5}, 2, {0, 1, 0, 1}).empty());
}

TEST(DiscBorders, LoopsWithoutASharedEdgeStayApart) { EXPECT_TRUE(united({0, 1, 2}, {2, 3, 4}, 0).empty()); }

} // namespace
} // namespace surflect::slf
