#include "render/evaluation/tile_errors.h"

#include <gtest/gtest.h>

#include <cmath>

namespace surflect::evaluation {
namespace {

image::Image opaque(int width, int height, float gray) {
  image::Image image(width, height, 4);
  image.values.assign(image.values.size(), gray);
  for (size_t i = 3; i < image.values.size(); i += 4) image.values[i] = 1;
  return image;
}

image::Image filled(int width, int height, float value) {
  image::Image image(width, height, 1);
  image.values.assign(image.values.size(), value);
  return image;
}

TEST(TileErrors, AreRootMeanSquaresAfterTheExposure) {
  const TileErrors tiles =
      tileErrors(opaque(32, 16, 0.25f), opaque(32, 16, 0.375f), filled(32, 16, 0.0625f), 2);
  ASSERT_EQ(tiles.measured.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_DOUBLE_EQ(tiles.measured[i], 0.25);
    EXPECT_DOUBLE_EQ(tiles.predicted[i], 0.125);
    EXPECT_DOUBLE_EQ(tiles.brightness[i], 0.75);
  }
}

// One pixel in a tile of 256 is wrong, by 0.5 in one channel of three.
TEST(TileErrors, ASinglePixelCountsByItsShare) {
  const image::Image truth = opaque(16, 16, 0.25f);
  image::Image rendered = truth;
  rendered.at(3, 7)[1] = 0.75f;
  EXPECT_DOUBLE_EQ(tileErrors(truth, rendered, filled(16, 16, 0), 1).measured.at(0),
                   std::sqrt(0.25 / 3 / 256));
}

// Pictures of 19 and 20 columns: the second of two tiles has 3 or 4 of its 16 columns.
TEST(TileErrors, TilesWithLittleOfTheObjectAreLeftOut) {
  EXPECT_EQ(tileErrors(opaque(19, 16, 0.5f), opaque(19, 16, 0.5f), filled(19, 16, 1), 1).measured.size(), 1u);
  EXPECT_EQ(tileErrors(opaque(20, 16, 0.5f), opaque(20, 16, 0.5f), filled(20, 16, 1), 1).measured.size(), 2u);
  EXPECT_TRUE(
      tileErrors(image::Image(32, 32, 4), image::Image(32, 32, 4), filled(32, 32, 1), 1).measured.empty());
}

TEST(TileErrors, TexelsThatAreNoNumberInTheTruthAreLeftOut) {
  image::Image truth = opaque(16, 16, 0.5f);
  truth.at(0, 0)[0] = NAN;
  image::Image predicted = filled(16, 16, 0.5f);
  predicted.at(0, 0)[0] = 100;
  const TileErrors tiles = tileErrors(truth, opaque(16, 16, 0.5f), predicted, 1);
  EXPECT_DOUBLE_EQ(tiles.measured.at(0), 0);
  EXPECT_DOUBLE_EQ(tiles.predicted.at(0), 0.5);
}

TEST(TileErrors, RelativeOnesAreOverTheBrightnessOfTilesThatAreNotBlack) {
  const TileErrors relative = relativeErrors({{0.1, 0.2, 0.3}, {0.2, 0.2, 0.2}, {0.5, 0, 0.25}});
  EXPECT_EQ(relative.measured, (std::vector<double>{0.2, 1.2}));
  EXPECT_EQ(relative.predicted, (std::vector<double>{0.4, 0.8}));
}

} // namespace
} // namespace surflect::evaluation
