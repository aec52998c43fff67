#include "render/evaluation/flip.h"

#include "srf/image/color.h"
#include "surfel/math/space.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

namespace surflect::evaluation {
namespace {

image::Image constantImage(int width, int height, Rgb color) {
  image::Image image(width, height, 3);
  for (size_t i = 0; i < image.values.size(); i += 3)
    image.values[i] = color.r, image.values[i + 1] = color.g, image.values[i + 2] = color.b;
  return image;
}

// Smooth colours with some noise.
image::Image smoothNoise(unsigned seed, int width, int height, float noise) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  const double fx = uniform(rng), fy = uniform(rng);
  image::Image image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (size_t c = 0; c < 3; ++c) {
        const double smooth = 0.5 + 0.4 * std::sin(fx * x + static_cast<double>(c)) * std::cos(fy * y);
        image.at(x, y)[c] = std::clamp(static_cast<float>(smooth) + noise * (uniform(rng) - 0.5f), 0.f, 1.f);
      }
  return image;
}

image::Image shifted(const image::Image& image, int dx, int dy) {
  image::Image result = image;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      std::ranges::copy(
          image.at(std::clamp(x - dx, 0, image.width - 1), std::clamp(y - dy, 0, image.height - 1)),
          result.at(x, y).begin());
  return result;
}

float valueOf(Rgb a, Rgb b) { return flip(constantImage(8, 8, a), constantImage(8, 8, b)).at(3, 3)[0]; }

TEST(Flip, EqualPicturesDoNotDiffer) {
  const image::Image image = smoothNoise(1, 33, 21, 0.5f);
  EXPECT_EQ(std::ranges::max(flip(image, image).values), 0);
}

TEST(Flip, IsSymmetricAndBetweenZeroAndOne) {
  const image::Image a = smoothNoise(2, 33, 21, 0.9f), b = smoothNoise(3, 33, 21, 0.9f);
  const image::Image ab = flip(a, b);
  EXPECT_EQ(ab.values, flip(b, a).values);
  for (const float value : ab.values) EXPECT_TRUE(value > 0 && value <= 1);
}

// Black and white: HyAB is 100, the largest is 203.3; green and blue are the largest by definition.
TEST(Flip, KnownColoursHaveKnownDifferences) {
  const double d = std::pow(100, 0.7), largest = std::pow(203.3, 0.7);
  EXPECT_NEAR(valueOf({0, 0, 0}, {1, 1, 1}), 0.95 + 0.05 * (d - 0.4 * largest) / (0.6 * largest), 1e-4);
  EXPECT_NEAR(valueOf({0, 0, 0}, {1, 1, 1}), 0.967, 5e-4);
  EXPECT_NEAR(valueOf({0, 1, 0}, {0, 0, 1}), 1, 1e-6);
}

TEST(Flip, FollowsPicturesThatAreShifted) {
  const image::Image a = smoothNoise(4, 60, 60, 0.2f), b = smoothNoise(5, 60, 60, 0.2f);
  const image::Image here = flip(a, b), there = flip(shifted(a, 4, 3), shifted(b, 4, 3));
  for (int y = 20; y < 40; ++y) // beyond the reach of borders
    for (int x = 20; x < 40; ++x) EXPECT_NEAR(here.at(x, y)[0], there.at(x + 4, y + 3)[0], 1e-6);
}

TEST(Flip, LargerErrorsAreLarger) {
  const image::Image image = smoothNoise(6, 40, 40, 0.1f);
  float last = 0;
  for (const float error : {0.01f, 0.05f, 0.2f}) {
    image::Image other = image;
    for (float& value : other.values) value = std::clamp(value + error, 0.f, 1.f);
    const float now = flip(image, other).at(20, 20)[0];
    EXPECT_GT(now, last);
    last = now;
  }
}

// A lone pixel of noise is less visible than a whole area; from afar it is less visible still.
TEST(Flip, SmallThingsFadeWithDistance) {
  const image::Image gray = constantImage(41, 41, {0.2f, 0.2f, 0.2f});
  image::Image dot = gray;
  std::ranges::fill(dot.at(20, 20), 0.8f);
  const float near = flip(gray, dot, 20).at(20, 20)[0], far = flip(gray, dot, 67).at(20, 20)[0];
  EXPECT_GT(near, far);
  EXPECT_GT(valueOf({0.2f, 0.2f, 0.2f}, {0.8f, 0.8f, 0.8f}), far);
}

// FLIP at one pixel as the paper writes it: sums over two dimensions, with the constants as printed.
// [Andersson 2020, Eqs. 3-9, Table 1]
struct PlainFlip {
  static constexpr double pi = 3.14159265358979323846, p = 67;
  static constexpr int at = 22; // column and row

  struct Seen {
    Vec3<double> lab;
    double edge, point;
  };

  Mat3<double> xyzFromRgb{{0.4124564, 0.3575761, 0.1804375},
                          {0.2126729, 0.7151522, 0.0721750},
                          {0.0193339, 0.1191920, 0.9503041}};
  Vec3<double> white = xyzFromRgb * Vec3<double>::Ones();

  Vec3<double> relative(const Vec3<double>& rgb) const { return (xyzFromRgb * rgb).cwiseQuotient(white); }
  Vec3<double> relative(const image::Image& image, int x, int y) const {
    const auto rgb = image.at(at + x, at + y);
    return relative({rgb[0], rgb[1], rgb[2]});
  }
  Vec3<double> lab(const Vec3<double>& rgb) const {
    const Vec3<double> f = relative(rgb).unaryExpr(
        [](double t) { return t > 216. / 24389 ? std::cbrt(t) : 841. / 108 * t + 4. / 29; });
    const double L = 116 * f.y() - 16;
    return {L, 0.01 * L * 500 * (f.x() - f.y()), 0.01 * L * 200 * (f.y() - f.z())};
  }

  Vec3<double> color(const image::Image& image) const {
    const auto gaussian = [](double a, double b, double z) {
      return a * std::sqrt(pi / b) * std::exp(-pi * pi * z / b);
    };
    Vec3<double> sum = Vec3<double>::Zero(), weight = sum;
    for (int y = -10; y <= 10; ++y)
      for (int x = -10; x <= 10; ++x) {
        const double z = (x * x + y * y) / (p * p);
        const Vec3<double> t = relative(image, x, y);
        const Vec3<double> w(gaussian(1, 0.0047, z), gaussian(1, 0.0053, z),
                             gaussian(34.1, 0.04, z) + gaussian(13.5, 0.025, z));
        sum += w.cwiseProduct(Vec3<double>(116 * t.y() - 16, 500 * (t.x() - t.y()), 200 * (t.y() - t.z())));
        weight += w;
      }
    const Vec3<double> c = sum.cwiseQuotient(weight);
    const double y = (c[0] + 16) / 116;
    const Vec3<double> xyz = Vec3<double>(y + c[1] / 500, y, y - c[2] / 200).cwiseProduct(white);
    return lab((xyzFromRgb.inverse() * xyz).cwiseMax(0).cwiseMin(1));
  }

  // Length of the gradient of luminance by a kernel of x, and by the same kernel of y.
  double feature(const image::Image& image, const std::function<double(int)>& derivative) const {
    const double sigma = 0.5 * 0.082 * p;
    double positive = 0, negative = 0;
    const auto sum = [&](auto visit) {
      for (int y = -9; y <= 9; ++y)
        for (int x = -9; x <= 9; ++x)
          visit(x, y, derivative(x) * std::exp(-(x * x + y * y) / (2 * sigma * sigma)));
    };
    sum([&](int, int, double w) { (w > 0 ? positive : negative) += std::abs(w); });
    double alongX = 0, alongY = 0;
    sum([&](int x, int y, double w) {
      w /= w > 0 ? positive : negative;
      alongX += w * relative(image, x, y).y();
      alongY += w * relative(image, y, x).y();
    });
    return std::hypot(alongX, alongY);
  }

  Seen seen(const image::Image& image) const {
    const double sigma = 0.5 * 0.082 * p;
    return {color(image), feature(image, [](int x) { return -x; }),
            feature(image, [&](int x) { return x * x / (sigma * sigma) - 1; })};
  }

  double value(const image::Image& a, const image::Image& b) const {
    const auto hyab = [](const Vec3<double>& d) { return std::abs(d[0]) + std::hypot(d[1], d[2]); };
    const Seen seenA = seen(a), seenB = seen(b);
    const double c_max = std::pow(hyab(lab({0, 1, 0}) - lab({0, 0, 1})), 0.7);
    const double d = std::pow(hyab(seenA.lab - seenB.lab), 0.7), p_c = 0.4, p_t = 0.95;
    const double dE_c = d < p_c * c_max ? p_t / (p_c * c_max) * d
                                        : p_t + (d - p_c * c_max) / (c_max - p_c * c_max) * (1 - p_t);
    const double dE_f = std::sqrt(
        std::max(std::abs(seenA.edge - seenB.edge), std::abs(seenA.point - seenB.point)) / std::sqrt(2.));
    return std::pow(dE_c, 1 - dE_f);
  }
};

TEST(Flip, MatchesThePlainForm) {
  const PlainFlip plain;
  for (const unsigned seed : {7u, 8u, 9u}) { // colours far apart, and near
    const image::Image a = smoothNoise(seed, 45, 45, 0.4f), other = smoothNoise(seed + 10, 45, 45, 0.4f);
    image::Image b = a;
    for (size_t i = 0; i < b.values.size(); ++i)
      b.values[i] = std::lerp(a.values[i], other.values[i], seed == 7 ? 1.f : 0.1f);
    EXPECT_NEAR(flip(a, b).at(22, 22)[0], plain.value(a, b), 2e-5) << seed;
  }
}

TEST(Flip, MeanIsThatOfTheMask) {
  image::Image values(3, 1, 1);
  values.values = {0.5f, 1, 0.25f};
  image::Mask mask(3, 1);
  mask.inside = {1, 0, 1};
  EXPECT_EQ(meanOver(values, mask).mean(), 0.375);
}

TEST(Flip, LargerErrorsAreDrawnLighter) {
  float last = -1;
  for (int i = 0; i <= 20; ++i) {
    const Rgb color = errorColor(i / 20.);
    const float light = image::luma(
        {image::linearFromSrgb(color.r), image::linearFromSrgb(color.g), image::linearFromSrgb(color.b)});
    EXPECT_GT(light, last);
    last = light;
  }
}

} // namespace
} // namespace surflect::evaluation
