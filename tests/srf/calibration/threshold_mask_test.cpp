#include "srf/calibration/threshold_mask.h"

#include "tests/srf/image/files.h"

#include <cmath>

namespace surflect {
namespace {

constexpr int size = 80;

// Pixels of a mask by a predicate over centres.
template <class Inside> Mask maskOf(const Inside& inside) {
  Mask mask(size, size);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) mask.inside[static_cast<size_t>(y * size + x)] = inside(x + 0.5, y + 0.5);
  return mask;
}

Image lit(const Mask& mask, float object, float background, int channels = 1) {
  Image image(size, size, channels);
  for (size_t i = 0; i < image.values.size(); ++i)
    image.values[i] = mask.inside[i / static_cast<size_t>(channels)] ? object : background;
  return image;
}

const Mask disc = maskOf([](double x, double y) { return std::hypot(x - 40, y - 40) < 25; });

TEST(ObjectByThreshold, IsWhatAnyPhotographShows) {
  // Each photograph lights one half; the halves differ in brightness.
  const Mask left = maskOf([](double x, double y) { return std::hypot(x - 40, y - 40) < 25 && x < 40; }),
             right = maskOf([](double x, double y) { return std::hypot(x - 40, y - 40) < 25 && x > 40; });
  for (const int channels : {1, 3}) {
    const Image photographs[] = {lit(left, 2, 0.05f, channels), lit(right, 1, 0.05f, channels)};
    EXPECT_EQ(objectByThreshold(photographs, 0.1), disc);
    EXPECT_EQ(objectByThreshold(photographs, 0.6), left);
  }
}

TEST(ObjectByThreshold, SpecksGoAndSmallHolesAreFilled) {
  const auto at = [](double x, double y, double cx, double cy, double r) {
    return std::hypot(x - cx, y - cy) < r;
  };
  const Mask spoilt = maskOf([&](double x, double y) {
    return (at(x, y, 40, 40, 25) && !at(x, y, 45, 35, 4) && !at(x, y, 30, 40, 2)) || at(x, y, 72, 8, 3);
  });
  const Image photograph = lit(spoilt, 1, 0);
  EXPECT_EQ(objectByThreshold(std::span(&photograph, 1), 0.2), disc);
}

TEST(ObjectByThreshold, SecondPartsAndLargeHolesStay) {
  const Mask ring = maskOf([](double x, double y) {
    const double r = std::hypot(x - 32, y - 40);
    return (r > 12 && r < 25) || std::hypot(x - 70, y - 40) < 8;
  });
  const Image photograph = lit(ring, 1, 0);
  EXPECT_EQ(objectByThreshold(std::span(&photograph, 1), 0.2), ring);
}

TEST(ObjectByThreshold, ScaleAndABrightPixelDoNotMatter) {
  Image photograph = randomImage(size, size, 3, 0, 0.1f, 1);
  for (size_t i = 0; i < photograph.values.size(); ++i) photograph.values[i] += disc.inside[i / 3] ? 0.5f : 0;
  EXPECT_EQ(objectByThreshold(std::span(&photograph, 1), 0.5), disc);
  for (float& value : photograph.values) value *= 7;
  photograph.at(41, 41)[1] = 1e6f;
  EXPECT_EQ(objectByThreshold(std::span(&photograph, 1), 0.5), disc);
}

TEST(ObjectByThreshold, BlackPhotographsHaveNoObject) {
  const Image black[] = {Image(size, size, 3), Image(size, size, 3)};
  EXPECT_EQ(objectByThreshold(black, 0.1), Mask(size, size));
  const Image sizes[] = {Image(size, size, 3), Image(size, 3, 3)};
  EXPECT_NE(errorOf([&] { objectByThreshold(sizes, 0.1); }).find("different sizes"), std::string::npos);
}

} // namespace
} // namespace surflect
