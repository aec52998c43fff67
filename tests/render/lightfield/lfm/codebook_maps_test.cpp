#include "render/lightfield/lfm/codebook_maps.h"

#include "render/lightfield/lfm/radiance.h"
#include "tests/render/lightfield/lfm/synthetic_maps.h"
#include "tests/srf/image/files.h"
#include "tests/support/random.h"

#include <cmath>
#include <random>

namespace surflect::lfm {
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
  for (const Method method : {Method::pca, Method::nmf}) {
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
