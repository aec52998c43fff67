#include "surfel/geometry/mesh.h"

#include <gtest/gtest.h>

namespace surflect {
namespace {

TEST(Mesh, AreaIsThatOfTheTriangles) {
  // Right triangles with legs of 3 and 4, and of 4 and 5.
  const TriangleMesh mesh{{{0, 0, 1}, {3, 0, 1}, {0, 4, 1}, {0, 0, 6}}, {{0, 1, 2}, {0, 2, 3}}};
  EXPECT_EQ(areaVector(mesh, 0), Vec3<double>(0, 0, 12));
  EXPECT_DOUBLE_EQ(surfaceArea(mesh), 6 + 10);
  EXPECT_EQ(surfaceArea({}), 0);
}

} // namespace
} // namespace surflect
