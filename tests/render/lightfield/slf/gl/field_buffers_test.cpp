#include "render/lightfield/slf/slf_frame.h"

#include "bench/slf/synthetic_field.h"
#include "tests/render/gl/gl_test.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <random>
#include <vector>

namespace surflect::slf {
namespace {

using namespace bench;

class FieldBuffersTest : public gl::GlTest {};

TEST(HatRows, GiveTheHatFunctionsUpToAFactor) {
  const DirectionMesh mesh(octahedronDirections(2));
  std::mt19937 random(1);
  for (int trial = 0; trial < 300; ++trial) {
    const auto r = assume<Direction>(randomUnit(random));
    const HatWeights hats = mesh.weightsAt(r);
    const Vec3<double> products = hatRows(mesh, hats.triangle) * r.raw();
    for (size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(products[static_cast<Eigen::Index>(c)] / products.sum(), hats.weights[c], 1e-12);
  }
}

TEST_F(FieldBuffersTest, PartsAreTheTrianglesOfTheRegions) {
  const Field field = syntheticField({.cells = 2, .quads = 3, .middle = {5, 6, 7}});
  const FieldBuffers buffers(field);
  size_t first = 0;
  for (size_t region = 0; region < field.regions.size(); ++region) {
    EXPECT_EQ(buffers.partOf(region).first, first);
    EXPECT_EQ(buffers.partOf(region).count, 3 * field.regions[region].chart.triangles.size());
    first += buffers.partOf(region).count;
  }
  EXPECT_EQ(first, 3 * field.mesh.triangles.size());
  EXPECT_LT((buffers.boxCentred().min() + buffers.boxCentred().max()).norm(), 1e-12);
  EXPECT_LT((buffers.middle() - Vec3<double>(5, 6, 7)).norm(), 0.1);
}

TEST_F(FieldBuffersTest, ASureHatIsThatOfTheTriangleWithTheDirection) {
  Field field = syntheticField({.cells = 1, .quads = 1});
  field.directionMeshes.emplace_back(octahedronDirections(3));
  const FieldBuffers buffers(field);
  std::mt19937 random(2);
  for (size_t m = 0; m < field.directionMeshes.size(); ++m) {
    const DirectionMesh& mesh = field.directionMeshes[m];
    const auto rows = buffers.rows(m);
    ASSERT_EQ(rows.size(), 3 * mesh.triangles().size());
    size_t sure = 0;
    constexpr int kTrials = 300;
    for (int trial = 0; trial < kTrials; ++trial) {
      const auto r = assume<Direction>(randomUnit(random));
      const Vec3<float> single = r.raw().cast<float>();
      for (size_t t = 0; t < mesh.triangles().size(); ++t) {
        const auto hat = [&](size_t c) { return rows[3 * t + c].head<3>().dot(single); };
        if (std::min({hat(0), hat(1), hat(2)}) <= buffers.sureHat(m)) continue;
        ++sure;
        EXPECT_EQ(mesh.triangleAt(r), t);
      }
    }
    EXPECT_GE(sure, 0.98 * kTrials); // all but those near an edge
    EXPECT_LE(sure, kTrials);
  }
}

TEST_F(FieldBuffersTest, CornersAreTheDirectionsWithTheirNumbers) {
  const Field field = syntheticField({.cells = 1, .quads = 1});
  const FieldBuffers buffers(field);
  const DirectionMesh& mesh = field.directionMeshes[0];
  const auto corners = buffers.corners(0);
  ASSERT_EQ(corners.size(), 3 * mesh.triangles().size());
  for (size_t i = 0; i < corners.size(); ++i) {
    const uint32_t direction = mesh.triangles()[i / 3][i % 3];
    EXPECT_EQ(corners[i][3], static_cast<float>(direction));
    EXPECT_EQ(corners[i].head<3>(), mesh.directions()[direction].cast<float>().raw());
  }
}

TEST_F(FieldBuffersTest, TheRowTextureHoldsTheRows) {
  const Field field = syntheticField({.cells = 1, .quads = 1});
  const FieldBuffers buffers(field);
  const gl::Texture& texture = buffers.rowTexture(0);
  EXPECT_EQ(texture.shape().width, 3);
  const image::Image read = texture.read();
  const auto rows = buffers.rows(0);
  ASSERT_EQ(read.values.size(), 4 * rows.size());
  for (size_t i = 0; i < read.values.size(); ++i)
    EXPECT_EQ(read.values[i], rows[i / 4][static_cast<Eigen::Index>(i % 4)]);
}

} // namespace
} // namespace surflect::slf
