#include "render/lightfield/common/photographs.h"

#include "tests/support/box_capture.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
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

namespace {

constexpr int kSize = 32;

class PhotographsTest : public ::testing::Test {
protected:
  PhotographsTest() {
    studio::photograph({.cameras = 3, .lights = 0, .size = kSize}, folder_.path());
    views_.emplace(folder_.path());
    photographs_.emplace(*views_);
  }

  // Distance from a camera to the sphere through a position of its picture.
  std::optional<double> distanceAt(size_t photograph, capture::Pixel position) const {
    const auto& camera = photographs_->camera(photograph);
    const auto worldFromCamera = camera.cameraFromWorld.inverse();
    const auto ray = capture::rayThrough(camera.lens, position);
    const auto hit = views_->rays().firstHit(worldFromCamera(ray->origin), worldFromCamera(ray->direction));
    return hit ? std::optional(hit->distance) : std::nullopt;
  }
  // Sample where the sphere is seen at a position.
  std::optional<Photographs::Sample> at(size_t photograph, capture::Pixel position, double error = 0) const {
    const auto distance = distanceAt(photograph, position);
    return distance ? photographs_->at(photograph, position, *distance + error, 0.5) : std::nullopt;
  }

  image::TemporaryFolder folder_;
  std::optional<Views> views_;
  std::optional<Photographs> photographs_;
};

TEST_F(PhotographsTest, AtPixelCentresAreThePictures) {
  for (size_t i = 0; i < photographs_->size(); ++i) {
    const image::Image picture = views_->read(i);
    size_t seen = 0;
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) {
        const auto sample = at(i, {x + 0.5, y + 0.5});
        if (!sample) continue;
        ++seen;
        for (int channel = 0; channel < 3; ++channel)
          EXPECT_NEAR(sample->radiance[channel], picture.at(x, y)[channel],
                      0.0005f * picture.at(x, y)[channel]);
      }
    EXPECT_GT(seen, 150u);
  }
}

TEST_F(PhotographsTest, BetweenPixelCentresAreMeans) {
  size_t compared = 0;
  for (int y = 1; y < kSize; ++y)
    for (int x = 1; x < kSize; ++x) {
      const auto middle = at(0, {double(x), double(y)});
      Vec3<float> sum = Vec3<float>::Zero();
      int count = 0;
      for (const double dx : {-0.5, 0.5})
        for (const double dy : {-0.5, 0.5})
          if (const auto corner = at(0, {x + dx, y + dy})) sum += corner->radiance, ++count;
      if (!middle || count < 4) continue;
      ++compared;
      EXPECT_LE((middle->radiance - sum / 4).norm(), 1e-6f);
    }
  EXPECT_GT(compared, 100u);
}

TEST_F(PhotographsTest, DoNotShowAPointAtAnotherDistance) {
  const capture::Pixel middle{kSize / 2.0 + 0.3, kSize / 2.0 - 0.1};
  EXPECT_TRUE(at(0, middle));
  EXPECT_FALSE(at(0, middle, 0.7));
  EXPECT_FALSE(at(0, middle, -0.7));
}

// From the middle of the sphere outwards, in steps of a hundredth of a pixel.
TEST_F(PhotographsTest, FadeContinuouslyTowardsTheOutline) {
  std::mt19937 random(1);
  for (int n = 0; n < 20; ++n) {
    const double angle = std::uniform_real_distribution(0., 7.)(random);
    double last = 1;
    for (double reach = 0; reach < 0.6 * kSize; reach += 0.01) {
      const auto sample =
          at(0, {kSize / 2.0 + reach * std::cos(angle), kSize / 2.0 + reach * std::sin(angle)});
      if (!sample) break;
      // The steepest slope of the smooth step is 1/2 per pixel, and more on a diagonal between codes.
      EXPECT_NEAR(sample->fade, last, 0.008);
      last = static_cast<double>(sample->fade);
    }
    EXPECT_LT(last, 0.3); // 7/27 where all four pixels are at the outline
  }
}

// The patch in the middle of one picture has no numbers.
TEST(Photographs, DoNotShowWhatIsNotANumber) {
  for (const float none :
       {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity()}) {
    const image::TemporaryFolder folder;
    const auto radiance = [&](const Vec3<double>& place, const Vec3<double>&) {
      return place.tail<2>().cwiseAbs().maxCoeff() < 0.1 ? Rgb{1, none, 1} : Rgb{1, 2, 4};
    };
    boxes::writeCapture(boxes::unitCube(), radiance, {{{1, 0, 0}}, kSize, 0.2}, folder.path());
    const Views views(folder.path());
    const Photographs photographs(views);
    const auto shows = [&](double offset) { // in pixels, which are 0.0443 wide at the distance of 3.5
      return photographs.at(0, {kSize / 2 + offset, kSize / 2.0}, std::hypot(3.5, 0.0443 * offset), 0.05);
    };
    EXPECT_FALSE(shows(0));
    EXPECT_FALSE(shows(2.4)); // within a pixel of the last without a number
    ASSERT_TRUE(shows(2.6));
    EXPECT_EQ(shows(2.6)->radiance, Vec3<float>(1, 2, 4));
    EXPECT_LT(shows(2.6)->fade, shows(4)->fade);
    EXPECT_EQ(photographs.whiteLevel(), 4);
  }
}

TEST_F(PhotographsTest, AreOfTrainingViewsAlone) {
  const image::TemporaryFolder folder;
  studio::photograph({.cameras = 6,
                      .lights = 0,
                      .size = 16,
                      .split =
                          [](size_t view, size_t) {
                            return std::optional(view % 3 == 0 ? capture::Split::train
                                                               : capture::Split::test);
                          }},
                     folder.path());
  const Views views(folder.path());
  const Photographs photographs(views);
  ASSERT_EQ(photographs.size(), 2u);
  EXPECT_EQ(photographs.camera(1).center().raw(), views.camera(3).center().raw());
}

} // namespace

} // namespace surflect::lightfield
