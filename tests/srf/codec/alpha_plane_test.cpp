#include "srf/codec/alpha_plane.h"

#include "tests/srf/image/files.h"

namespace surflect::codec {
namespace {

image::Image constantAlpha(int width, int height, float alpha) {
  image::Image image(width, height, 1);
  std::ranges::fill(image.values, alpha);
  return image;
}

TEST(AlphaPlane, AConstantComesBackWithinHalfALevelEverywhere) {
  const AlphaPlane plane(constantAlpha(19, 13, 0.55f));
  for (const float x : {-3.f, 0.f, 0.5f, 7.9f, 8.3f, 18.6f, 40.f})
    for (const float y : {-1.f, 0.2f, 8.f, 12.9f, 99.f}) EXPECT_NEAR(plane.at(x, y), 0.55f, 0.5 / 255 + 1e-6);
}

TEST(AlphaPlane, PixelCentresHaveTheirOwnLevelsAndBetweenThemItIsLinear) {
  const image::Image alpha = image::randomImage(37, 21, 1, 0, 1, 5);
  const AlphaPlane plane(alpha);
  for (int y = 0; y < alpha.height; ++y)
    for (int x = 0; x < alpha.width; ++x) {
      const auto u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
      EXPECT_NEAR(plane.at(u, v), alpha.at(x, y)[0], 0.5 / 255 + 1e-6);
      if (x + 1 == alpha.width || y + 1 == alpha.height) continue;
      EXPECT_NEAR(plane.at(u + 0.25f, v), 0.75f * plane.at(u, v) + 0.25f * plane.at(u + 1, v), 1e-6);
      EXPECT_NEAR(plane.at(u, v + 0.75f), 0.25f * plane.at(u, v) + 0.75f * plane.at(u, v + 1), 1e-6);
    }
}

TEST(AlphaPlane, BlocksThatAreClearOrOpaqueTakeNoTexels) {
  image::Image alpha(64, 64, 1); // clear on the left, opaque on the right, one block of both
  for (int y = 0; y < 64; ++y)
    for (int x = 32; x < 64; ++x) alpha.at(x, y)[0] = 1;
  const size_t grid = AlphaPlane(constantAlpha(64, 64, 0)).memoryBytes();
  EXPECT_EQ(grid, 64 * sizeof(uint32_t));
  EXPECT_EQ(AlphaPlane(constantAlpha(64, 64, 1)).memoryBytes(), grid);
  EXPECT_EQ(AlphaPlane(alpha).memoryBytes(), grid);
  alpha.at(3, 3)[0] = 0.5f;
  EXPECT_EQ(AlphaPlane(alpha).memoryBytes(), grid + 64);
}

TEST(AlphaPlane, ItsLevelsMakeTheSamePlane) {
  const AlphaPlane plane(image::randomImage(37, 21, 1, -0.2f, 1.2f, 6));
  const std::vector<uint8_t> levels = plane.levels();
  EXPECT_EQ(AlphaPlane(37, 21, levels).levels(), levels);
}

} // namespace
} // namespace surflect::codec
