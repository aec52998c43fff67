#include "bench/quality/packing_quality.h"

#include "surfel/base/error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace surflect::bench {
namespace {

// Smooth and a little noisy, the object a disc.
codec::ReflectanceStack photographs(uint64_t seed) {
  constexpr int kSide = 48;
  std::mt19937_64 random(seed);
  std::normal_distribution<float> gauss;
  codec::ReflectanceStack stack{kSide, kSide, std::vector<image::Image>(16, image::Image(kSide, kSide, 3)),
                                image::Image(kSide, kSide, 1)};
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      stack.alpha.at(x, y)[0] = std::hypot(x - 24, y - 24) < 20 ? 1.f : 0.f;
      for (size_t l = 0; l < stack.lights.size(); ++l)
        for (float& value : stack.lights[l].at(x, y))
          value = 1 + std::cos(0.1f * static_cast<float>(x) + static_cast<float>(l)) + 0.02f * gauss(random);
    }
  return stack;
}

TEST(PackingQuality, KeepsToItsBytesAndComesNear) {
  const std::vector<codec::ReflectanceStack> views{photographs(1), photographs(2)};
  for (const double bytes : {0.5, 0.7, 1.0}) {
    const PackingQuality quality = qualityAt(bytes, views);
    EXPECT_LE(quality.bytes, bytes);
    EXPECT_GT(quality.bytes, 0.993 * bytes); // the file has whole levels; measured 0.9964 at least
  }
}

// Packed as it says, the photographs have the size and the error that it says.
TEST(PackingQuality, IsThatOfItsTolerance) {
  const std::vector<codec::ReflectanceStack> views{photographs(1), photographs(2)};
  const PackingQuality quality = qualityAt(0.7, views);
  codec::ViewSummary sum;
  for (const codec::ReflectanceStack& view : views)
    sum += codec::encodeView(view, {.tolerance = quality.tolerance, .white = quality.white}).summary;
  EXPECT_EQ(quality.texels, sum.objectTexels);
  EXPECT_EQ(quality.lights, 16u);
  EXPECT_DOUBLE_EQ(quality.bytes,
                   static_cast<double>(sum.fileBytes) / static_cast<double>(16 * sum.objectTexels));
  EXPECT_DOUBLE_EQ(quality.db, codec::psnrDb(sum, quality.white));
}

TEST(PackingQuality, MoreBytesAreBetter) {
  const std::vector<codec::ReflectanceStack> views{photographs(3)};
  EXPECT_GT(qualityAt(1.0, views).db, qualityAt(0.6, views).db + 1);
}

TEST(PackingQuality, TooFewBytesAreAnError) {
  EXPECT_THROW(qualityAt(0.01, std::vector<codec::ReflectanceStack>{photographs(3)}), Error);
}

TEST(PackingQuality, NothingSeenIsAnError) {
  std::vector<codec::ReflectanceStack> views{photographs(1)};
  std::ranges::fill(views[0].alpha.values, 0.f);
  EXPECT_THROW(qualityAt(0.6, views), Error);
}

} // namespace
} // namespace surflect::bench
