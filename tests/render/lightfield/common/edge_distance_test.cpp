#include "render/lightfield/common/edge_distance.h"

#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

namespace surflect::lightfield {
namespace {

constexpr int kWidth = 16, kHeight = 12;

// Plane through `point`.
struct Plane {
  Vec3<double> point, normal;
};

// Pixels that look along -z from the origin, 100 to a unit at distance 1; each sees one of the planes.
std::vector<PixelHit> hitsOf(const std::function<std::optional<Plane>(int x, int y)>& planeAt) {
  std::vector<PixelHit> hits;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const Vec3<double> direction =
          Vec3<double>((x - kWidth / 2) / 100.0, (y - kHeight / 2) / 100.0, -1).normalized();
      PixelHit& hit = hits.emplace_back();
      hit.direction = assume<Direction3<AcquisitionSpace, double>>(direction);
      if (const auto plane = planeAt(x, y)) {
        hit.distance = plane->normal.dot(plane->point) / plane->normal.dot(direction);
        hit.normal = plane->normal;
      }
    }
  return hits;
}

// Unit normal of a plane that is seen at up to 80 degrees.
Vec3<double> drawNormal(std::mt19937& random) {
  for (;;)
    if (const Vec3<double> normal = randomUnit(random); normal[2] > 0.17) return normal;
}

bool isFarFromEdges(uint8_t code) { return code == kFarFromEdges * kCodesPerPixel; }

TEST(EdgeDistance, APlaneHasNoEdges) {
  std::mt19937 random(1);
  for (int n = 0; n < 200; ++n) {
    const Plane plane{{0, 0, -4}, drawNormal(random)};
    EXPECT_TRUE(
        std::ranges::all_of(edgeDistances(hitsOf([&](int, int) { return plane; }), kWidth), isFarFromEdges));
  }
}

TEST(EdgeDistance, ACreaseIsNoEdge) {
  std::mt19937 random(2);
  for (int n = 0; n < 200; ++n) {
    const Vec3<double> onCrease(0, 0, -4);
    const Plane a{onCrease, drawNormal(random)}, b{onCrease, drawNormal(random)};
    // The nearer or the further of two planes through a point: convex or concave.
    const bool convex = n % 2 == 0;
    const auto nearer = hitsOf([&](int, int) { return a; }), further = hitsOf([&](int, int) { return b; });
    const auto hits = hitsOf([&](int x, int y) {
      const auto i = static_cast<size_t>(y * kWidth + x);
      return (nearer[i].distance < further[i].distance) == convex ? a : b;
    });
    EXPECT_TRUE(std::ranges::all_of(edgeDistances(hits, kWidth), isFarFromEdges));
  }
}

TEST(EdgeDistance, FromAStepOfDepthItGrowsByOneAPixel) {
  std::mt19937 random(3);
  for (int n = 0; n < 50; ++n) {
    const Vec3<double> normal = drawNormal(random);
    const double slope = std::sqrt(1 - normal[2] * normal[2]) / normal[2];
    const Plane front{{0, 0, -4}, normal}, back{{0, 0, -4 - 0.04 * (3 + 2 * slope)}, normal};
    constexpr int kEdge = 7; // first column of the plane behind
    const auto distances =
        edgeDistances(hitsOf([&](int x, int) { return x < kEdge ? front : back; }), kWidth);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x) {
        const int expected = std::min(kFarFromEdges, x < kEdge ? kEdge - x : x - kEdge + 1);
        EXPECT_EQ(distances[static_cast<size_t>(y * kWidth + x)], kCodesPerPixel * expected);
      }
  }
}

TEST(EdgeDistance, AroundAHoleItIsEuclidean) {
  const Plane plane{{0, 0, -4}, {0, 0, 1}};
  const auto distances = edgeDistances(
      hitsOf([&](int x, int y) { return x == 8 && y == 6 ? std::nullopt : std::optional(plane); }), kWidth);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      // Pixels around the hole are the edge.
      const double dx = std::max(0, std::abs(x - 8) - 1), dy = std::max(0, std::abs(y - 6) - 1);
      const double expected = x == 8 && y == 6 ? 0 : std::min<double>(kFarFromEdges, 1 + std::hypot(dx, dy));
      EXPECT_EQ(distances[static_cast<size_t>(y * kWidth + x)], std::lround(kCodesPerPixel * expected));
    }
}

} // namespace
} // namespace surflect::lightfield
