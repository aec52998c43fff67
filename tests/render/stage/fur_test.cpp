#include "render/stage/fur.h"

#include "render/stage/shapes.h"
#include "surfel/base/error.h"
#include "tests/render/stage/surfaces.h"

#include <gtest/gtest.h>

namespace surflect::stage {
namespace {

TEST(Fur, StandsOnTheSkinAlongItsNormals) {
  const Surface skin = sphere({0, 0, 0}, 1, 64);
  const Surface hairs = fur(skin, {.hairs = 500, .length = 0.2, .radius = 0.005});
  EXPECT_TRUE(isClosed(hairs.mesh));
  EXPECT_GT(volumeOf(hairs.mesh), 0);
  for (size_t i = 0; i < hairs.mesh.positions.size(); ++i) {
    const Vec3<double> p = hairs.mesh.positions[i].cast<double>().raw(), t = hairs.tangents[i].raw();
    EXPECT_LT(p.norm(), 1.2 + 1e-4);
    EXPECT_GT(p.norm(), 0.99); // the root's half sphere, and the facets of the skin
    if (p.norm() > 1.01 && t.norm() > 0) {
      EXPECT_GT(t.normalized().dot(p.normalized()), 0.98);
    }
  }
}

TEST(Fur, IsCombed) {
  const Surface skin = box({0, 0, 0}, {1, 1, 1}, 4);
  const Vec3<double> comb(0, 0, -0.5);
  const Surface hairs = fur(skin, {.hairs = 300, .length = 0.2, .radius = 0.002, .comb = comb});
  const Surface straight = fur(skin, {.hairs = 300, .length = 0.2, .radius = 0.002});
  ASSERT_EQ(hairs.mesh.positions.size(), straight.mesh.positions.size());
  Vec3<double> sum = Vec3<double>::Zero();
  double lowest = 0;
  for (size_t i = 0; i < hairs.mesh.positions.size(); ++i) {
    const Vec3<double> moved =
        hairs.mesh.positions[i].cast<double>().raw() - straight.mesh.positions[i].cast<double>().raw();
    lowest = std::min(lowest, moved.z());
    sum += moved;
  }
  EXPECT_NEAR(lowest, -0.1, 0.004); // the tips, by half a length
  EXPECT_GT(sum.normalized().dot(comb.normalized()), 0.999);
}

TEST(Fur, IsEvenOverTheArea) {
  // Boxes with faces of areas 2, 2, 2, 2, 1, 1 (z up: the small ones)
  const Surface skin = box({0, 0, 0}, {1, 1, 2}, 3);
  const int count = 6000;
  const Surface hairs = fur(skin, {.hairs = count, .length = 0.01, .radius = 1e-4});
  const size_t each = hairs.mesh.positions.size() / count;
  int ends = 0;
  for (int i = 0; i < count; ++i)
    ends += std::abs(hairs.mesh.positions[static_cast<size_t>(i) * each].z()) > 0.9999f;
  const double expected = count * 2. / 10, deviation = std::sqrt(expected * 0.8);
  EXPECT_NEAR(ends, expected, 4 * deviation);
}

TEST(Fur, HasTheTextureOfItsRootAndTheSameHairsForASeed) {
  const Surface skin = sphere({0, 0, 0}, 1, 64);
  const FurShape shape{.hairs = 20, .length = 0.2, .radius = 0.005, .disorder = 0.5};
  const Surface one = fur(skin, shape), again = fur(skin, shape);
  EXPECT_EQ(one.mesh.positions, again.mesh.positions);
  const size_t each = one.mesh.positions.size() / 20;
  for (size_t i = 0; i < one.mesh.positions.size(); ++i)
    EXPECT_EQ(one.textureCoordinates[i], one.textureCoordinates[i / each * each]);
  EXPECT_NE(one.textureCoordinates[0], one.textureCoordinates[each]);
  EXPECT_THROW(fur(skin, {.hairs = 1'000'000, .length = 1, .radius = 1}), Error);
}

} // namespace
} // namespace surflect::stage
