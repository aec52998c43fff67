#include "srf/calibration/strengths.h"

#include "tests/srf/image/files.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

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

namespace {

using Towards = Direction3<AcquisitionSpace, double>;

// Share of what a Lambert surface reflects.  [Oren, Nayar 1994, Generalization of Lambert's Reflectance
// Model, Eq. 30]
double rough(double sigma, const Vec3<double>& n, const Vec3<double>& l) {
  const Vec3<double> v(0, 0, 1);
  const double a = 1 - 0.5 * sigma * sigma / (sigma * sigma + 0.33),
               b = 0.45 * sigma * sigma / (sigma * sigma + 0.09);
  const double cosL = n.dot(l), cosV = n.dot(v);
  const Vec3<double> acrossL = l - cosL * n, acrossV = v - cosV * n;
  // cos(phi) sin(alpha) tan(beta): the sines of both angles, over the larger cosine.
  return a + b * std::max(0., acrossL.dot(acrossV)) / std::max({cosL, cosV, 1e-3});
}

// A bumpy relief, Lambert's unless it is rough, photographed under lights of known strengths.
struct Relief {
  int width = 90, size = 72; // of the picture, pixels: its height is `size`
  int lights = 14;
  double noise = 0.002;     // standard deviation, in units of a typical pixel
  double shadows = 0.08;    // share of samples that a neighbour shadows
  double highlights = 0.05; // share of samples with a highlight
  double clip = 1e9;        // largest sample
  double roughness = 0;     // of Oren and Nayar's surface, seen from above
  double unevenness = 0;    // how much the logarithm of strengths changes over the picture, at most
  unsigned seed = 1;

  std::vector<Towards> towards = {};
  std::vector<Rgb> strengths = {};
  std::vector<Vec2<double>> gradients = {}; // mean 0
  std::vector<image::Image> photographs = {};
  image::Mask object = {};

  void photograph() {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform;
    std::normal_distribution<double> normal;
    for (int l = 0; l < lights; ++l) {
      const double azimuth = 2.4 * l, tilt = 0.15 + 0.5 * uniform(random);
      towards.emplace_back(std::sin(tilt) * std::cos(azimuth), std::sin(tilt) * std::sin(azimuth),
                           std::cos(tilt));
      const auto strength = [&] { return static_cast<float>(0.4 + 1.4 * uniform(random)); };
      strengths.push_back({strength(), strength(), strength()});
      photographs.emplace_back(width, size, 3);
      gradients.emplace_back(unevenness * std::cos(5. * l), unevenness * std::sin(3. * l));
    }
    const Vec2<double> common =
        std::accumulate(gradients.begin(), gradients.end(), Vec2<double>(0, 0)) / lights;
    for (auto& gradient : gradients) gradient -= common;
    object = image::Mask(width, size);
    for (int y = 0; y < size; ++y)
      for (int x = 0; x < width; ++x) {
        const double u = (x + 0.5 - width / 2.) / size + 0.5, v = (y + 0.5) / size;
        if (std::hypot(u - 0.5, v - 0.5) > 0.48) continue;
        object.inside[static_cast<size_t>(y * width + x)] = 1;
        // Slopes of a ball with ripples.
        const Vec3<double> n = Vec3<double>(2.2 * (u - 0.5) + 0.3 * std::sin(20 * u + 5 * v),
                                            2.2 * (v - 0.5) + 0.3 * std::cos(17 * v - 9 * u), 1)
                                   .normalized();
        const Vec3<double> albedo(0.4 + 0.6 * uniform(random), 0.5 + 0.3 * std::sin(9 * u), 0.3 + 0.5 * v);
        for (size_t l = 0; l < towards.size(); ++l) {
          const double lit = uniform(random) < shadows ? 0.1 * uniform(random) : 1,
                       shine = uniform(random) < highlights ? 0.2 + uniform(random) : 0;
          const double cosine = std::max(0., n.dot(towards[l].raw())) *
                                (roughness > 0 ? rough(roughness, n, towards[l].raw()) : 1);
          const Rgb s = strengths[l];
          const double gain = std::exp(gradients[l].dot(Vec2<double>(u - 0.5, v - 0.5)));
          const double channel[3] = {gain * s.r, gain * s.g, gain * s.b};
          for (int c = 0; c < 3; ++c)
            photographs[l].at(x, y)[static_cast<size_t>(c)] = static_cast<float>(
                std::min(clip, channel[c] * (albedo[c] * cosine * lit + shine) + noise * normal(random)));
        }
      }
  }
};

std::vector<Rgb> meanOne(std::vector<Rgb> strengths) {
  Rgb sum;
  for (const Rgb s : strengths) sum = sum + s;
  const auto count = static_cast<float>(strengths.size());
  for (Rgb& s : strengths) s = s * Rgb{count / sum.r, count / sum.g, count / sum.b};
  return strengths;
}

double largestDifference(std::span<const Rgb> a, std::span<const Rgb> b) {
  double largest = 0;
  for (size_t l = 0; l < a.size(); ++l)
    for (const float d : {a[l].r - b[l].r, a[l].g - b[l].g, a[l].b - b[l].b})
      largest = std::max(largest, static_cast<double>(std::abs(d)));
  return largest;
}

// Largest error of the estimated strengths, with lights of known gradients.
double largestError(const Relief& relief) {
  return largestDifference(
      lightStrengths(relief.photographs, relief.object, relief.towards, relief.gradients),
      meanOne(relief.strengths));
}

double largestGradientError(const Relief& relief) {
  const auto found = lightGradients(relief.photographs, relief.object, relief.towards);
  double largest = 0;
  for (size_t l = 0; l < found.size(); ++l)
    largest = std::max(largest, (found[l] - relief.gradients[l]).cwiseAbs().maxCoeff());
  return largest;
}

TEST(LightStrengths, AreFoundExactlyWithoutNoise) {
  Relief relief{.noise = 0, .shadows = 0, .highlights = 0};
  relief.photograph();
  EXPECT_LT(largestError(relief), 4.5e-7);
}

TEST(LightStrengths, AreFoundThroughNoiseShadowsAndHighlights) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    Relief relief{.seed = seed};
    relief.photograph();
    EXPECT_LT(largestError(relief), 1e-3);
  }
}

TEST(LightStrengths, OfUnevenLightsAreFoundExactlyWithoutNoise) {
  Relief relief{.noise = 0, .shadows = 0, .highlights = 0, .unevenness = 0.5};
  relief.photograph();
  EXPECT_LT(largestError(relief), 4.5e-7);
  EXPECT_LT(largestGradientError(relief), 9e-9);
}

TEST(LightStrengths, OfUnevenLightsAreFoundThroughNoiseShadowsAndHighlights) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    Relief relief{.unevenness = 0.4, .seed = seed};
    relief.photograph();
    EXPECT_LT(largestError(relief), 1e-3);
    EXPECT_LT(largestGradientError(relief), 2e-3);
  }
}

TEST(LightGradients, OfEvenLightsAreNone) {
  Relief relief;
  relief.photograph();
  EXPECT_LT(largestGradientError(relief), 2e-3);
}

// Reason why gradients are not the default.
TEST(LightGradients, ARoughSurfaceMakesEvenLightsLookUneven) {
  Relief relief{.roughness = 0.3};
  relief.photograph();
  EXPECT_NEAR(largestGradientError(relief), 0.3, 0.02);
}

TEST(LightGradients, SameBitsForAnyThreads) {
  Relief relief{.width = 50, .size = 40, .unevenness = 0.4}; // pixels of three chunks
  relief.photograph();
  const auto found = [&](int threads) {
    std::vector<StrengthGradient> gradients;
    std::vector<Rgb> strengths;
    tbb::task_arena(threads).execute([&] {
      gradients = lightGradients(relief.photographs, relief.object, relief.towards);
      strengths = lightStrengths(relief.photographs, relief.object, relief.towards, gradients);
    });
    return std::pair(gradients, strengths);
  };
  EXPECT_EQ(found(1), found(2));
}

TEST(LightGradients, OfFewLightsOrPixelsAreRefused) {
  Relief few{.lights = 5};
  few.photograph();
  EXPECT_NE(image::errorOf([&] { lightGradients(few.photographs, few.object, few.towards); }).find("found 5"),
            std::string::npos);
  Relief relief;
  relief.photograph();
  image::Mask line(relief.width, relief.size); // along which gradients across it show nothing
  for (int y = 0; y < relief.size; ++y)
    line.inside[static_cast<size_t>(y * relief.width + relief.width / 2)] = 1;
  EXPECT_NO_THROW(lightStrengths(relief.photographs, line, relief.towards));
  EXPECT_NE(
      image::errorOf([&] { lightGradients(relief.photographs, line, relief.towards); }).find("do not tell"),
      std::string::npos);
}

TEST(LightStrengths, ClippedSamplesAreLeftOut) {
  Relief relief{.shadows = 0, .highlights = 0.05, .clip = 0.9};
  relief.photograph();
  EXPECT_LT(largestError(relief), 2e-3);
}

TEST(LightStrengths, DoNotDependOnScale) {
  Relief relief;
  relief.photograph();
  const auto strengths = lightStrengths(relief.photographs, relief.object, relief.towards);
  for (image::Image& image : relief.photographs)
    for (float& value : image.values) value *= 1024; // exact in floating point
  EXPECT_LT(largestDifference(lightStrengths(relief.photographs, relief.object, relief.towards), strengths),
            1e-7);
}

TEST(LightStrengths, FollowTheOrderOfTheLights) {
  Relief relief;
  relief.photograph();
  const auto strengths = lightStrengths(relief.photographs, relief.object, relief.towards);
  std::vector<size_t> order(relief.towards.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::shuffle(order.begin(), order.end(), std::mt19937(7));
  std::vector<image::Image> photographs = {};
  std::vector<Towards> towards = {};
  std::vector<Rgb> expected;
  for (const size_t l : order) {
    photographs.push_back(relief.photographs[l]);
    towards.push_back(relief.towards[l]);
    expected.push_back(strengths[l]);
  }
  // Sums in another order differ in double precision; strengths below 2 then by a rounding to float at most.
  EXPECT_LE(largestDifference(lightStrengths(photographs, relief.object, towards), expected),
            std::numeric_limits<float>::epsilon());
}

TEST(LightStrengths, OfGrayPhotographsAreGray) {
  Relief relief;
  relief.photograph();
  std::vector<image::Image> gray;
  for (const image::Image& image : relief.photographs) {
    image::Image& one = gray.emplace_back(image.width, image.height, 1);
    for (size_t i = 0; i < one.values.size(); ++i) one.values[i] = image.values[3 * i + 1];
  }
  const auto fromRgb = lightStrengths(relief.photographs, relief.object, relief.towards);
  const auto fromGray = lightStrengths(gray, relief.object, relief.towards);
  for (size_t l = 0; l < gray.size(); ++l) {
    EXPECT_EQ(fromGray[l].r, fromRgb[l].g);
    EXPECT_EQ(fromGray[l], (Rgb{fromGray[l].r, fromGray[l].r, fromGray[l].r}));
  }
}

TEST(LightStrengths, WhatCannotBeToldIsRefused) {
  Relief few{.lights = 3};
  few.photograph();
  EXPECT_NE(
      image::errorOf([&] { lightStrengths(few.photographs, few.object, few.towards); }).find("four lights"),
      std::string::npos);

  Relief relief;
  relief.photograph();
  auto plane = relief.towards; // all but the last
  for (size_t l = 0; l + 1 < plane.size(); ++l)
    plane[l] = Towards(std::sin(0.1 * double(l) - 0.7), 0, std::cos(0.1 * double(l) - 0.7));
  EXPECT_NE(
      image::errorOf([&] { lightStrengths(relief.photographs, relief.object, plane); }).find("in a plane"),
      std::string::npos);

  std::mt19937 random(1);
  std::normal_distribution<float> noise(0, 0.01f);
  std::vector<image::Image> flat;
  for (size_t l = 0; l < relief.towards.size(); ++l)
    for (float& value : flat.emplace_back(relief.photographs[l]).values)
      value = static_cast<float>(relief.towards[l].z()) + noise(random);
  EXPECT_NE(image::errorOf([&] { lightStrengths(flat, relief.object, relief.towards); }).find("flat"),
            std::string::npos);

  const image::Mask nothing(relief.width, relief.size);
  EXPECT_NE(
      image::errorOf([&] { lightStrengths(relief.photographs, nothing, relief.towards); }).find("found 0"),
      std::string::npos);
  const image::Mask other(relief.width, relief.size + 1);
  EXPECT_NE(image::errorOf([&] {
              lightStrengths(relief.photographs, other, relief.towards);
            }).find("photograph 0: found 90 x 72, expected 90 x 73"),
            std::string::npos);
}

} // namespace

} // namespace surflect::calibration
