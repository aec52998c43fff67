#include "render/lightfield/slf/used_directions.h"

#include "tests/support/box_capture.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace surflect::slf {
namespace {

TEST(UsedDirections, EveryDirectionInFrontFindsItsThreeTextures) {
  const TriangleMesh cube = boxes::unitCube();
  std::mt19937 random(1);
  for (const int level : {0, 1, 2}) {
    const DirectionMesh mesh(octahedronDirections(level));
    for (const Chart& chart : boxes::faceCharts(cube, 4)) {
      const std::vector<uint8_t> isUsed = usedDirections(cube, chart, mesh);
      const Vec3<double> normal = areaVector(cube, chart.meshTriangles[0]).normalized();
      for (int i = 0; i < 300; ++i) {
        const Vec3<double> r = randomUnit(random);
        if (r.dot(normal) < 0) continue;
        for (const uint32_t direction : mesh.weightsAt(assume<Direction>(r)).directions)
          EXPECT_EQ(isUsed[direction], 1);
      }
    }
  }
}

TEST(UsedDirections, AFlatRegionLeavesOutThoseFarBehindIt) {
  const TriangleMesh cube = boxes::unitCube();
  const DirectionMesh mesh(octahedronDirections(2));
  for (const Chart& chart : boxes::faceCharts(cube, 4)) {
    const std::vector<uint8_t> isUsed = usedDirections(cube, chart, mesh);
    const Vec3<double> normal = areaVector(cube, chart.meshTriangles[0]).normalized();
    for (size_t i = 0; i < isUsed.size(); ++i)
      if (mesh.directions()[i].raw().dot(normal) < -0.6) {
        EXPECT_EQ(isUsed[i], 0);
      } // 37 degrees behind
  }
}

TEST(UsedDirections, AClosedBodyUsesAll) {
  const TriangleMesh cube = boxes::unitCube();
  const DirectionMesh mesh(octahedronDirections(2));
  Chart whole;
  for (uint32_t t = 0; t < cube.triangles.size(); ++t) whole.meshTriangles.push_back(t);
  EXPECT_TRUE(std::ranges::all_of(usedDirections(cube, whole, mesh), [](uint8_t used) { return used == 1; }));
}

TEST(UsedDirections, TrianglesWithoutAreaUseNone) {
  TriangleMesh flat{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}};
  Chart chart;
  chart.meshTriangles = {0};
  const DirectionMesh mesh(octahedronDirections(1));
  EXPECT_TRUE(std::ranges::all_of(usedDirections(flat, chart, mesh), [](uint8_t used) { return used == 0; }));
}

} // namespace
} // namespace surflect::slf
