#include "render/lightfield/lfm/quantization.h"

#include "render/lightfield/lfm/radiance.h"
#include "tests/render/lightfield/lfm/synthetic_maps.h"
#include "tests/srf/image/files.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace surflect::lfm {

namespace {

std::vector<float> randomMap(float least, float most) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> value(least, most);
  std::vector<float> map(500);
  for (float& x : map) x = value(random);
  return map;
}

TEST(Quantization, EveryCodeIsThatOfItsValue) {
  for (int code = -127; code <= 127; ++code)
    EXPECT_EQ(snorm8Of(decodedSnorm8(static_cast<int8_t>(code))), code);
  for (int code = 0; code <= 255; ++code)
    EXPECT_EQ(unorm8Of(decodedUnorm8(static_cast<uint8_t>(code))), code);
  EXPECT_EQ(decodedSnorm8(-128), -1);
}

TEST(Quantization, ErrorsAreAtMostHalfAStep) {
  const std::vector<float> signs = randomMap(-3, 2), positive = randomMap(0, 0.01f);
  const float scale = scaleOf(signs), small = scaleOf(positive);
  const std::vector<float> decodedSigns = decoded(snorm8Of(signs, scale), scale),
                           decodedPositive = decoded(unorm8Of(positive, small), small);
  for (size_t i = 0; i < signs.size(); ++i) {
    EXPECT_LE(std::abs(decodedSigns[i] - signs[i]), scale / 254 * 1.0001f);
    EXPECT_LE(std::abs(decodedPositive[i] - positive[i]), small / 510 * 1.0001f);
  }
}

TEST(Quantization, ZeroIsExactAndTheLargestValueNearlySo) {
  const std::vector<float> map = {0, -0.7f, 0.7f, 0.1f};
  const std::vector<float> result = decoded(snorm8Of(map, scaleOf(map)), scaleOf(map));
  EXPECT_EQ(result[0], 0);
  EXPECT_FLOAT_EQ(result[1], -0.7f);
  EXPECT_FLOAT_EQ(result[2], 0.7f);
}

TEST(Quantization, ValuesBeyondTheScaleAreClampedAndNoScaleMeansZero) {
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinite = std::numeric_limits<float>::infinity();
  const std::vector<float> map = {2, -2, nan, infinite, -infinite};
  EXPECT_EQ(snorm8Of(map, 1), (std::vector<int8_t>{127, -127, 0, 127, -127}));
  EXPECT_EQ(unorm8Of(map, 1), (std::vector<uint8_t>{255, 0, 0, 255, 0}));
  EXPECT_EQ(snorm8Of(map, 0), (std::vector<int8_t>{0, 0, 0, 0, 0}));
}

TEST(Quantization, BiasedCodesKeepTheirOrder) {
  for (int code = -128; code <= 127; ++code) {
    EXPECT_EQ(biased(static_cast<int8_t>(code)), code + 128);
    EXPECT_EQ(unbiased(biased(static_cast<int8_t>(code))), code);
  }
}

} // namespace

namespace {

using namespace lfm::testing;

double rmsBetween(const LightFieldMaps& a, const LightFieldMaps& b) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(0, 0.5);
  double squares = 0;
  constexpr int kTrials = 500;
  for (int trial = 0; trial < kTrials; ++trial) {
    const TrianglePlace place{random() % a.mesh.triangles.size(), number(random), number(random)};
    const Direction d = assume<Direction>(randomUnit(random));
    squares +=
        (radianceAt(a, place, d, a.terms.size()) - radianceAt(b, place, d, b.terms.size())).squaredNorm();
  }
  return std::sqrt(squares / kTrials / 3);
}

TEST(CodebookMaps, AsManyCodewordsAsMapsChangeNothing) {
  for (const Factorization method : {Factorization::pca, Factorization::nmf}) {
    LightFieldMaps maps = syntheticMaps(bumpySphere(4, 6), {.method = method});
    maps.terms[1].scale[3] = 0;
    const LightFieldMaps found = withCodebooks(maps, {.ratio = 1});
    EXPECT_NO_THROW(requireComplete(found));
    EXPECT_LT(rmsBetween(found, maps), 1e-12);
    EXPECT_EQ(found.terms[1].view.mapOf[3], kNoMap);
  }
}

TEST(CodebookMaps, FewerCodewordsTakeFewerBytesAndErrMore) {
  for (const CodebookStart start : {CodebookStart::split, CodebookStart::pairwiseNearestNeighbors}) {
    const LightFieldMaps maps = syntheticMaps(bumpySphere(6, 8));
    double lastError = 0;
    size_t lastBytes = bytesOf(maps).total() + bytesOf(withCodebooks(maps, {.ratio = 1.0001})).indices;
    for (const double ratio : {1.3, 3., 10., 1000.}) {
      const LightFieldMaps found = withCodebooks(maps, {.start = start, .ratio = ratio});
      EXPECT_NO_THROW(requireComplete(found));
      EXPECT_LE(found.terms[0].view.maps.count,
                std::ceil(static_cast<double>(maps.mesh.positions.size()) / ratio));
      const double error = rmsBetween(found, maps);
      EXPECT_GT(error, lastError);
      EXPECT_LT(bytesOf(found).total(), lastBytes);
      lastError = error, lastBytes = bytesOf(found).total();
    }
    EXPECT_EQ(bytesOf(withCodebooks(maps)).mean, bytesOf(maps).mean);
  }
}

TEST(CodebookMaps, ALargerErrorTakesFewerBytes) {
  const LightFieldMaps maps = syntheticMaps(bumpySphere(6, 8));
  size_t lastBytes = bytesOf(withCodebooks(maps, {.ratio = 1})).total() + 1;
  for (const double error : {0.1, 0.3, 0.6}) {
    const LightFieldMaps found = withCodebooks(maps, {.ratio = 0, .distortion = error * error});
    EXPECT_LT(bytesOf(found).total(), lastBytes) << error;
    lastBytes = bytesOf(found).total();
  }
}

TEST(CodebookMaps, ABoundIsNeeded) {
  const LightFieldMaps maps = syntheticMaps(squarePatch(1));
  EXPECT_EQ(image::errorOf([&] { withCodebooks(maps, {.ratio = 0}); }),
            "codebooks: neither a ratio nor a distortion above 0");
}

} // namespace

} // namespace surflect::lfm
