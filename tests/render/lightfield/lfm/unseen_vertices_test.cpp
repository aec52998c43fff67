#include "render/lightfield/lfm/unseen_vertices.h"

#include "render/lightfield/lfm/patch_grid.h"
#include "render/lightfield/lfm/rings.h"
#include "tests/render/lightfield/slf/meshes.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

namespace surflect::lfm {
namespace {

const Vec3<float> kRingRoot(0.5f, 1, 2);

TEST(UnseenVertices, AConstantMatrixIsItsRootTimesTheHatFunctionAndUnobserved) {
  const Rings rings(slf::testing::squarePatch(2));
  const RingRows rows = ringRows(rings, 4, PatchGrid(5));
  const VertexMatrix matrix = constantMatrix(rows, 16, kRingRoot);
  EXPECT_EQ(matrix.unseenRows, matrix.rows);
  for (size_t row = 0; row < matrix.rows; ++row) {
    EXPECT_EQ(matrix.value(row, 7, 2), 2 * rows.hats[row]);
    EXPECT_EQ(matrix.weights[row * 16 + 7], 0);
  }
  EXPECT_EQ(meanRoot(matrix, rows), Vec3<float>(0, 0, 0));
}

TEST(UnseenVertices, TheMeanCountsObservedEntriesOnly) {
  const Rings rings(slf::testing::squarePatch(2));
  const RingRows rows = ringRows(rings, 4, PatchGrid(5));
  VertexMatrix matrix = constantMatrix(rows, 16, kRingRoot);
  for (size_t row = 0; row < matrix.rows; ++row) {
    matrix.weights[row * 16 + 7] = 0.25f;
    matrix.value(row, 8, 0) = 100;
  }
  EXPECT_LT((meanRoot(matrix, rows) - kRingRoot).norm(), 1e-6);
}

TEST(UnseenVertices, RootsSpreadFromSeenVerticesOutwards) {
  // A row of five squares, and a triangle apart.
  std::vector<Vec3<double>> positions;
  slf::testing::Triangles triangles;
  for (uint32_t i = 0; i < 6; ++i) {
    positions.emplace_back(i, 0, 0);
    positions.emplace_back(i, 1, 0);
  }
  for (uint32_t a = 0; a < 10; a += 2) {
    triangles.push_back({a, a + 2, a + 3});
    triangles.push_back({a, a + 3, a + 1});
  }
  TriangleMesh mesh = slf::testing::meshOf(positions, triangles);
  mesh = slf::testing::together(mesh, slf::testing::meshOf({{9, 0, 0}, {9, 1, 0}, {9, 0, 1}}, {{0, 1, 2}}));
  const Rings rings(mesh);
  std::vector<uint8_t> isSeen(15, 0);
  std::vector<Vec3<float>> roots(15, Vec3<float>::Zero());
  for (const uint32_t v : {0u, 1u}) isSeen[v] = 1, roots[v] = kRingRoot;
  for (const uint32_t v : {10u, 11u}) isSeen[v] = 1, roots[v] = 3 * kRingRoot;
  spreadToUnseen(rings, isSeen, roots);
  for (const uint32_t v : {2u, 3u}) EXPECT_LT((roots[v] - kRingRoot).norm(), 1e-6);
  for (const uint32_t v : {8u, 9u}) EXPECT_LT((roots[v] - 3 * kRingRoot).norm(), 1e-6);
  for (const uint32_t v : {12u, 13u, 14u}) EXPECT_EQ(roots[v], Vec3<float>(0, 0, 0));
  EXPECT_EQ(roots[0], kRingRoot);
}

} // namespace
} // namespace surflect::lfm
