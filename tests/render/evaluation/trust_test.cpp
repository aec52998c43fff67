#include "render/evaluation/trust.h"

#include <gtest/gtest.h>

namespace surflect::evaluation {
namespace {

// Three pixels of the object and one beside it; their predicted errors rise from 0.
TEST(Trust, CountsPixelsOfTheObjectWhosePredictedErrorIsSmall) {
  image::Image color(4, 1, 4), error(4, 1, 1);
  for (size_t pixel = 0; pixel < 4; ++pixel) {
    color.values[4 * pixel + 3] = pixel == 3 ? 0.25f : 1;
    error.values[pixel] = 0.02f * static_cast<float>(pixel);
  }
  const Trust trust = trustIn(color, error, 1);
  EXPECT_EQ(trust.pixels, 3u);
  EXPECT_EQ(trust.trusted, 2u); // 0 and 0.02 are below 10/255, 0.04 is not
  EXPECT_EQ(trustIn(color, error, 2).trusted, 3u);
  EXPECT_EQ(trustIn(color, error, 0).trusted, 1u);
}

TEST(Trust, AddsUpOverPictures) {
  Trust film{10, 4};
  film += {30, 26};
  EXPECT_DOUBLE_EQ(film.share(), 0.75);
  EXPECT_DOUBLE_EQ(Trust().share(), 1);
}

} // namespace
} // namespace surflect::evaluation
