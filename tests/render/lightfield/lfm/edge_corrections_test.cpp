#include "render/lightfield/lfm/edge_corrections.h"

#include "render/lightfield/lfm/quantization.h"
#include "render/lightfield/lfm/radiance.h"
#include "render/lightfield/lfm/tile.h"
#include "tests/render/lightfield/lfm/edge_places.h"
#include "tests/render/lightfield/lfm/synthetic_maps.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <utility>

namespace surflect::lfm {
namespace {

using namespace lfm::testing;

// Barycentrics on the edge from a corner to the next, at a share 0..1 of it.
Vec3<double> placeOn(size_t corner, double share) {
  Vec3<double> b = Vec3<double>::Zero();
  b[static_cast<Eigen::Index>(corner)] = 1 - share;
  b[static_cast<Eigen::Index>((corner + 1) % 3)] = share;
  return b;
}

// Values on edges that agree at corners.
double valueOn(size_t corner, double share) {
  const std::array<double, 3> atCorners{0.3, -0.7, 0.9};
  return (1 - share) * atCorners[corner] + share * atCorners[(corner + 1) % 3] +
         share * (1 - share) * static_cast<double>(1 + corner);
}

TEST(EdgeInterpolants, HaveTheGivenValuesOnEdges) {
  for (const size_t n : {2u, 3u, 16u})
    for (size_t corner = 0; corner < 3; ++corner)
      for (const double share : {0.0, 0.01, 0.3, 0.8, 1.0}) {
        EXPECT_NEAR(fromEdges(placeOn(corner, share), valueOn, n), valueOn(corner, share), 1e-12);
        EXPECT_NEAR(fromSides(placeOn(corner, share), corner, 5, 7, n), share > 0 ? 5 : 6, 1e-12);
        EXPECT_NEAR(fromSides(placeOn((corner + 2) % 3, 1 - share), corner, 5, 7, n), share > 0 ? 7 : 6,
                    1e-12);
      }
}

TEST(EdgeInterpolants, AreContinuousAndFadeWithTheDistance) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> number(0, 1);
  const auto one = [](size_t, double) { return 1.0; };
  for (int trial = 0; trial < 300; ++trial) {
    const double a = number(random), c = (1 - a) * number(random), step = 1e-6;
    const Vec3<double> b(a, c, 1 - a - c), beside(a * (1 - step), c, 1 - a * (1 - step) - c);
    EXPECT_NEAR(fromEdges(b, valueOn, 16), fromEdges(beside, valueOn, 16), 1e-3);
    EXPECT_NEAR(fromSides(b, 1, 5, 7, 16), fromSides(beside, 1, 5, 7, 16), 1e-3);
    const double least = b.minCoeff(); // distance from the nearest edge
    EXPECT_LE(fromEdges(b, one, 16), fade(least, 16) + 1e-12);
    EXPECT_LE(fromSides(b, 0, 1, 1, 16), fade(std::min(b[1], b[2]), 16) + 1e-12);
    if (least * 15 > kFadeSteps) EXPECT_EQ(fromEdges(b, one, 16), 0);
  }
}

std::map<std::string, LightFieldMaps> compressedMaps(Factorization method, size_t channels) {
  const LightFieldMaps maps =
      syntheticMaps(bumpySphere(5, 7, 0.1), {.method = method, .samples = 6, .channels = channels});
  const LightFieldMaps codebooks = withCodebooks(maps, {.ratio = 3, .means = true});
  return {{"VQ", codebooks}, {"S3TC", encoded(maps)}, {"VQ and S3TC", encoded(codebooks)}};
}

// Largest step of radiance across edges, and root mean square of all.
std::pair<double, double> stepsOf(const LightFieldMaps& maps, const EdgeCorrections& edges) {
  std::mt19937 random(2);
  double largest = 0, squares = 0, count = 0;
  for (const auto& [a, b] : edgePlaces(maps.mesh, random)) {
    const Direction d = assume<Direction>(randomUnit(random));
    for (size_t terms = 0; terms <= maps.terms.size(); ++terms) {
      const double step =
          (radianceAt(maps, a, d, terms, edges) - radianceAt(maps, b, d, terms, edges)).norm();
      largest = std::max(largest, step), squares += step * step, ++count;
    }
  }
  return {largest, std::sqrt(squares / count)};
}

TEST(EdgeCorrections, LeaveNoStepAcrossEdgesForEveryNumberOfTerms) {
  for (const Factorization method : {Factorization::pca, Factorization::nmf})
    for (const size_t channels : {size_t{3}, size_t{4}})
      for (const auto& [name, maps] : compressedMaps(method, channels)) {
        const LightFieldMaps plain = decoded(maps);
        EXPECT_GT(stepsOf(plain, {}).second, 0.01) << name;
        EXPECT_LT(stepsOf(plain, edgeCorrections(maps)).first, 1e-12) << name;
      }
}

TEST(EdgeCorrections, AreNoneForMapsThatAgreeOnEdges) {
  const EdgeCorrections edges = edgeCorrections(syntheticMaps(bumpySphere(5, 7, 0.1)));
  EXPECT_TRUE(edges.surface.empty());
  EXPECT_TRUE(edges.mean.empty());
}

TEST(EdgeCorrections, AreThoseOfTheSameMapsHoweverTheyAreStored) {
  for (const auto& [name, maps] : compressedMaps(Factorization::pca, 3)) {
    const EdgeCorrections coded = edgeCorrections(maps), plain = edgeCorrections(decoded(maps));
    EXPECT_EQ(coded.surface, plain.surface) << name;
    EXPECT_EQ(coded.mean, plain.mean) << name;
  }
}

} // namespace
} // namespace surflect::lfm
