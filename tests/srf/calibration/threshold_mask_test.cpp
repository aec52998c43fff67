#include "srf/calibration/threshold_mask.h"

#include "tests/srf/image/files.h"

#include <cmath>

namespace surflect::calibration {
namespace {

constexpr int size = 80;

// Pixels of a mask by a predicate over centres.
template <class Inside> image::Mask maskOf(const Inside& inside) {
  image::Mask mask(size, size);
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x) mask.inside[static_cast<size_t>(y * size + x)] = inside(x + 0.5, y + 0.5);
  return mask;
}

image::Image lit(const image::Mask& mask, float object, float background, int channels = 1) {
  image::Image image(size, size, channels);
  for (size_t i = 0; i < image.values.size(); ++i)
    image.values[i] = mask.inside[i / static_cast<size_t>(channels)] ? object : background;
  return image;
}

const image::Mask disc = maskOf([](double x, double y) { return std::hypot(x - 40, y - 40) < 25; });

TEST(ObjectByThreshold, IsWhatAnyPhotographShows) {
  // Each photograph lights one half; the halves differ in brightness.
  const image::Mask left =
                        maskOf([](double x, double y) { return std::hypot(x - 40, y - 40) < 25 && x < 40; }),
                    right =
                        maskOf([](double x, double y) { return std::hypot(x - 40, y - 40) < 25 && x > 40; });
  for (const int channels : {1, 3}) {
    const image::Image photographs[] = {lit(left, 2, 0.05f, channels), lit(right, 1, 0.05f, channels)};
    EXPECT_EQ(objectByThreshold(photographs, 0.1), disc);
    EXPECT_EQ(objectByThreshold(photographs, 0.6), left);
  }
}

bool isNear(double x, double y, double centerX, double centerY, double radius) {
  return std::hypot(x - centerX, y - centerY) < radius;
}

// The disc lit, with a shadow of 50 of its nearly 2000 pixels and a crack of 12, and a speck beside it.
image::Image spoiltDisc(float shadow, float crack, float scale = 1) {
  const image::Mask lightAt = maskOf([](double x, double y) {
    return (isNear(x, y, 40, 40, 25) && !isNear(x, y, 45, 35, 4) && !isNear(x, y, 30, 40, 2)) ||
           isNear(x, y, 72, 8, 3);
  }),
                    shadowAt = maskOf([](double x, double y) { return isNear(x, y, 45, 35, 4); }),
                    crackAt = maskOf([](double x, double y) { return isNear(x, y, 30, 40, 2); });
  image::Image photograph(size, size, 1);
  for (size_t i = 0; i < photograph.values.size(); ++i)
    photograph.values[i] = scale * (lightAt.inside[i]    ? 1
                                    : shadowAt.inside[i] ? shadow
                                    : crackAt.inside[i]  ? crack
                                                         : 0.f);
  return photograph;
}

TEST(ObjectByThreshold, SpecksGoAndShadowsAndCracksAreFilled) {
  const image::Image photograph = spoiltDisc(0.05f, 0);
  EXPECT_EQ(objectByThreshold(std::span(&photograph, 1), 0.2), disc);
}

TEST(ObjectByThreshold, GapsThatShowTheBackgroundStay) {
  const image::Mask pierced =
      maskOf([](double x, double y) { return isNear(x, y, 40, 40, 25) && !isNear(x, y, 45, 35, 4); });
  for (const float scale : {1.f, 0.01f, 300.f}) {
    const image::Image photograph = spoiltDisc(0.03f, 0, scale);
    EXPECT_EQ(objectByThreshold(std::span(&photograph, 1), 0.2), pierced);
  }
}

TEST(ObjectByThreshold, AGapLitInPartsIsTold) {
  image::Image photograph = spoiltDisc(0, 0);
  const image::Mask reflection = maskOf([](double x, double y) { return isNear(x, y, 45, 35, 4) && x > 46; });
  for (size_t i = 0; i < photograph.values.size(); ++i)
    if (reflection.inside[i]) photograph.values[i] = 0.15f;
  EXPECT_EQ(objectByThreshold(std::span(&photograph, 1), 0.2),
            maskOf([](double x, double y) { return isNear(x, y, 40, 40, 25) && !isNear(x, y, 45, 35, 4); }));
}

TEST(ObjectByThreshold, SecondPartsAndLargeHolesStay) {
  const image::Mask ring = maskOf([](double x, double y) {
    const double r = std::hypot(x - 32, y - 40);
    return (r > 12 && r < 25) || std::hypot(x - 70, y - 40) < 8;
  });
  const image::Image photograph = lit(ring, 1, 0);
  EXPECT_EQ(objectByThreshold(std::span(&photograph, 1), 0.2), ring);
}

TEST(ObjectByThreshold, ScaleAndABrightPixelDoNotMatter) {
  image::Image photograph = image::randomImage(size, size, 3, 0, 0.1f, 1);
  for (size_t i = 0; i < photograph.values.size(); ++i) photograph.values[i] += disc.inside[i / 3] ? 0.5f : 0;
  EXPECT_EQ(objectByThreshold(std::span(&photograph, 1), 0.5), disc);
  for (float& value : photograph.values) value *= 7;
  photograph.at(41, 41)[1] = 1e6f;
  EXPECT_EQ(objectByThreshold(std::span(&photograph, 1), 0.5), disc);
}

TEST(ObjectByThreshold, BlackPhotographsHaveNoObject) {
  const image::Image black[] = {image::Image(size, size, 3), image::Image(size, size, 3)};
  EXPECT_EQ(objectByThreshold(black, 0.1), image::Mask(size, size));
  const image::Image sizes[] = {image::Image(size, size, 3), image::Image(size, 3, 3)};
  EXPECT_NE(image::errorOf([&] { objectByThreshold(sizes, 0.1); }).find("different sizes"),
            std::string::npos);
}

} // namespace
} // namespace surflect::calibration
