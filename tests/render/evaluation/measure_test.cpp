#include "render/evaluation/measure.h"

#include "srf/image/color.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace surflect::evaluation {
namespace {

image::Image randomImage(std::mt19937& rng, int width, int height, int channels) {
  image::Image image(width, height, channels);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (float& value : image.values) value = uniform(rng);
  return image;
}

image::Mask randomMask(std::mt19937& rng, int width, int height, double share) {
  image::Mask mask(width, height);
  std::bernoulli_distribution inside(share);
  for (auto& value : mask.inside) value = inside(rng);
  return mask;
}

image::Mask fullMask(const image::Image& image) {
  image::Mask mask(image.width, image.height);
  mask.inside.assign(mask.inside.size(), 1);
  return mask;
}

image::Image plus(image::Image image, float offset) {
  for (float& value : image.values) value += offset;
  return image;
}

// Truth and rendering differ by 0.1 where the truth is a number, and by far more elsewhere.
TEST(Measure, TexelsThatAreNoNumberInTheTruthAreLeftOut) {
  image::Image truth(24, 24, 4), rendered(24, 24, 4);
  truth.values.assign(truth.values.size(), 0.5f);
  for (size_t i = 3; i < truth.values.size(); i += 4) truth.values[i] = 1;
  rendered.values = truth.values;
  for (size_t i = 0; i < rendered.values.size(); ++i)
    if (i % 4 != 3) rendered.values[i] += 0.1f;
  const Difference whole = compare(truth, rendered, 1);
  for (const size_t texel : {size_t{30}, size_t{300}}) {
    truth.values[4 * texel + (texel == 30)] = texel == 30 ? NAN : INFINITY;
    rendered.values[4 * texel] = 1;
  }
  EXPECT_EQ(invalidTexels(truth), 2u);
  const Difference difference = compare(truth, rendered, 1);
  EXPECT_EQ(difference.squaredErrorLinear.count, whole.squaredErrorLinear.count - 6);
  EXPECT_EQ(difference.similaritySrgb.count, whole.similaritySrgb.count - 2);
  EXPECT_NEAR(difference.psnrLinear(), 20, 1e-5);
  EXPECT_NEAR(difference.psnrSrgb(), whole.psnrSrgb(), 1e-5);
  for (const size_t texel : {size_t{30}, size_t{300}}) rendered.values[4 * texel] = 0;
  EXPECT_EQ(compare(truth, rendered, 1).ssim(), difference.ssim());
}

TEST(Measure, PsnrOfAConstantOffsetIsItsLevel) {
  std::mt19937 rng(1);
  const image::Image image = randomImage(rng, 31, 17, 3);
  for (const float offset : {0.5f, 0.1f, 0.01f})
    EXPECT_NEAR(psnr(squaredError(image, plus(image, offset), fullMask(image)).mean()),
                -20 * std::log10(offset), 1e-3);
  EXPECT_EQ(psnr(squaredError(image, image, fullMask(image)).mean()),
            std::numeric_limits<double>::infinity());
}

TEST(Measure, OnlyTheMaskCounts) {
  std::mt19937 rng(2);
  const image::Image a = randomImage(rng, 40, 30, 3);
  image::Image b = a;
  const image::Mask mask = randomMask(rng, 40, 30, 0.5);
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x)
      if (!mask.inside[static_cast<size_t>(y * 40 + x)]) b.at(x, y)[1] = 7;
  EXPECT_EQ(squaredError(a, b, mask).sum, 0);
  EXPECT_GT(squaredError(a, b, fullMask(a)).sum, 1);
}

TEST(Measure, PoolsPixelsNotDecibels) {
  std::mt19937 rng(3);
  const image::Image small = randomImage(rng, 8, 8, 3), large = randomImage(rng, 16, 16, 3);
  PooledMean pooled = squaredError(small, plus(small, 0.1f), fullMask(small));
  pooled += squaredError(large, plus(large, 0.3f), fullMask(large));
  EXPECT_NEAR(pooled.mean(), (64 * 0.01 + 256 * 0.09) / 320, 1e-7);
}

TEST(Measure, SsimOfIdenticalImagesIsOne) {
  std::mt19937 rng(4);
  const image::Image image = randomImage(rng, 40, 25, 3);
  EXPECT_NEAR(structuralSimilarity(image, image, fullMask(image)).mean(), 1, 1e-12);
}

TEST(Measure, SsimOfTwoFlatImagesIsTheLuminanceTerm) {
  image::Image a(20, 20, 3), b(20, 20, 3);
  std::fill(a.values.begin(), a.values.end(), 0.4f);
  std::fill(b.values.begin(), b.values.end(), 0.7f);
  const double expected = (2 * 0.4 * 0.7 + 1e-4) / (0.4 * 0.4 + 0.7 * 0.7 + 1e-4);
  EXPECT_NEAR(structuralSimilarity(a, b, fullMask(a)).mean(), expected, 1e-6);
}

// The definition, window by window, without separating it.
TEST(Measure, SsimAgreesWithItsDefinition) {
  std::mt19937 rng(5);
  const image::Image a = randomImage(rng, 23, 19, 3), b = randomImage(rng, 23, 19, 3);
  for (const auto& [cx, cy] : {std::pair{11, 9}, {0, 0}, {22, 3}, {5, 18}}) {
    image::Mask one(23, 19);
    one.inside[static_cast<size_t>(cy * 23 + cx)] = 1;
    double n = 0, ma = 0, mb = 0, aa = 0, bb = 0, ab = 0;
    for (int y = std::max(0, cy - 5); y <= std::min(18, cy + 5); ++y)
      for (int x = std::max(0, cx - 5); x <= std::min(22, cx + 5); ++x) {
        const double w = std::exp(-((x - cx) * (x - cx) + (y - cy) * (y - cy)) / 4.5);
        const double va = image::luma({a.at(x, y)[0], a.at(x, y)[1], a.at(x, y)[2]});
        const double vb = image::luma({b.at(x, y)[0], b.at(x, y)[1], b.at(x, y)[2]});
        n += w, ma += w * va, mb += w * vb, aa += w * va * va, bb += w * vb * vb, ab += w * va * vb;
      }
    ma /= n, mb /= n;
    const double expected = (2 * ma * mb + 1e-4) * (2 * (ab / n - ma * mb) + 9e-4) /
                            ((ma * ma + mb * mb + 1e-4) * (aa / n - ma * ma + bb / n - mb * mb + 9e-4));
    EXPECT_NEAR(structuralSimilarity(a, b, one).mean(), expected, 1e-12);
  }
}

TEST(Measure, ErosionIsTheSetWhoseDiscFits) {
  std::mt19937 rng(6);
  const image::Mask mask = randomMask(rng, 33, 21, 0.97);
  for (int n = 0; n < 5; ++n) {
    image::Mask expected(33, 21);
    for (int y = 0; y < 21; ++y)
      for (int x = 0; x < 33; ++x) {
        bool fits = true;
        for (int j = 0; j < 21; ++j)
          for (int i = 0; i < 33; ++i)
            if ((i - x) * (i - x) + (j - y) * (j - y) <= n * n &&
                !mask.inside[static_cast<size_t>(j * 33 + i)])
              fits = false;
        expected.inside[static_cast<size_t>(y * 33 + x)] = fits;
      }
    EXPECT_EQ(image::eroded(mask, n), expected) << n;
  }
}

TEST(Measure, IntersectionOverUnionOfShiftedSquares) {
  const auto square = [](int x0) {
    image::Mask mask(30, 10);
    for (int y = 0; y < 10; ++y)
      for (int x = x0; x < x0 + 10; ++x) mask.inside[static_cast<size_t>(y * 30 + x)] = 1;
    return mask;
  };
  EXPECT_EQ(image::intersectionOverUnion(square(3), square(3)), 1);
  EXPECT_DOUBLE_EQ(image::intersectionOverUnion(square(3), square(8)), 5.0 / 15);
  EXPECT_EQ(image::intersectionOverUnion(square(0), square(10)), 0);
  EXPECT_EQ(image::intersectionOverUnion(image::Mask(4, 4), image::Mask(4, 4)), 1);
  EXPECT_DOUBLE_EQ(image::intersectionOverUnion(square(3), image::unionOf(square(3), square(13))), 0.5);
}

TEST(Measure, ExposedClipsWhatIsInfiniteToWhite) {
  constexpr float infinite = std::numeric_limits<float>::infinity();
  image::Image image(5, 1, 1);
  image.values = {0.25f, 3, infinite, -infinite, std::numeric_limits<float>::quiet_NaN()};
  EXPECT_EQ(applyExposure(image, 2).values, (std::vector<float>{0.5f, 1, 1, 0, 0}));
}

TEST(Measure, ComparesExposedClippedValuesOverTheUnionOfTheMasks) {
  image::Image truth(4, 1, 4), rendered(4, 1, 4);
  const auto set = [](image::Image& image, int x, float grey, float alpha) {
    const auto pixel = image.at(x, 0);
    pixel[0] = pixel[1] = pixel[2] = grey;
    pixel[3] = alpha;
  };
  set(truth, 0, 0.1f, 1), set(rendered, 0, 0.2f, 1);                                    // 0.2 and 0.4
  set(truth, 1, 5, 1), set(rendered, 1, 9, 1);                                          // both clipped
  set(truth, 2, 0, 0), set(rendered, 2, std::numeric_limits<float>::quiet_NaN(), 0.6f); // rendered alone
  set(truth, 3, 3, 0.4f), set(rendered, 3, 1, 0.5f);                                    // in neither
  const Difference difference = compare(truth, rendered, 2);
  EXPECT_EQ(difference.squaredErrorLinear.count, 9u);
  EXPECT_NEAR(difference.squaredErrorLinear.sum, 3 * 0.2 * 0.2, 1e-7);
  const double srgb = image::srgbFromLinear(0.4f) - image::srgbFromLinear(0.2f);
  EXPECT_NEAR(difference.squaredErrorSrgb.sum, 3 * srgb * srgb, 1e-6);
  EXPECT_NEAR(difference.absoluteErrorSrgb.sum, 3 * std::abs(srgb), 1e-6);
  EXPECT_EQ(difference.similaritySrgb.count, 3u);
}

TEST(Measure, AlphaIsComparedWhereEitherImageShowsTheObject) {
  image::Image truth(4, 1, 4), rendered(4, 1, 4);
  truth.at(0, 0)[3] = 0.5f, rendered.at(0, 0)[3] = 0.75f;
  rendered.at(1, 0)[3] = 0.1f;
  truth.at(2, 0)[3] = 0.001f; // less than half a level of 8 bits
  const PooledMean error = alphaError(truth, rendered);
  EXPECT_EQ(error.count, 2u);
  EXPECT_NEAR(error.sum, 0.35, 1e-6);
  EXPECT_EQ(compare(truth, rendered, 1).absoluteErrorAlpha.count, 2u);
}

TEST(NoiseVariance, IsThatOfWhiteNoiseOnAPlane) {
  std::mt19937_64 random(3);
  std::normal_distribution<float> noise(0, 0.05f);
  image::Image image(200, 200, 3);
  for (int y = 0; y < 200; ++y)
    for (int x = 0; x < 200; ++x)
      for (float& value : image.at(x, y))
        value = 0.3f + 0.002f * static_cast<float>(x - 2 * y) + noise(random);
  image::Mask all(200, 200);
  std::ranges::fill(all.inside, uint8_t{1});
  EXPECT_NEAR(noiseVariance(image, all).mean(), 0.05 * 0.05, 0.04 * 0.05 * 0.05);
}

TEST(NoiseVariance, IsZeroOnAPlane) {
  image::Image image(50, 40, 3);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 50; ++x) std::ranges::fill(image.at(x, y), static_cast<float>(x + 3 * y));
  image::Mask all(50, 40);
  std::ranges::fill(all.inside, uint8_t{1});
  EXPECT_EQ(noiseVariance(image, all).mean(), 0);
}

} // namespace
} // namespace surflect::evaluation
