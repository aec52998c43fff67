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

} // namespace
} // namespace surflect::slf
