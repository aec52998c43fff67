#include "srf/import/calibrate.h"

#include "tests/srf/image/files.h"

namespace surflect::importers {
namespace {

TEST(Shrunk, PixelsAreMeansOfTheirSquares) {
  const image::Image image = image::randomImage(11, 8, 3, 0, 1, 1);
  for (const int factor : {1, 2, 3}) {
    const image::Image small = shrunk(image, factor);
    ASSERT_EQ(small.width, 11 / factor);
    ASSERT_EQ(small.height, 8 / factor);
    for (int y = 0; y < small.height; ++y)
      for (int x = 0; x < small.width; ++x)
        for (size_t c = 0; c < 3; ++c) {
          double mean = 0;
          for (int k = 0; k < factor * factor; ++k)
            mean += image.at(x * factor + k % factor, y * factor + k / factor)[c];
          EXPECT_NEAR(small.at(x, y)[c], mean / (factor * factor), 1e-6);
        }
  }
}

TEST(Shrunk, AMaskKeepsWholeSquares) {
  image::Mask mask(6, 4);
  for (const size_t i : {0, 1, 6, 7, 2, 3, 8})
    mask.inside[i] = 1; // one square, and three quarters of the next
  const image::Mask small = shrunk(mask, 2);
  EXPECT_EQ(small.inside, (std::vector<uint8_t>{1, 0, 0, 0, 0, 0}));
  EXPECT_EQ(shrunk(mask, 1), mask);
}

} // namespace
} // namespace surflect::importers
