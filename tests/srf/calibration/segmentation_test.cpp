#include "srf/calibration/segmentation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace surflect::calibration {
namespace {

constexpr int kAcross = 96;

// A disc of one colour before a backdrop, without noise.
struct DiscScene {
  Rgb disc{0.2f, 0.25f, 0.5f};
  double radius = 24.3;

  // Share of the pixel, from 64 places.
  double coverage(int x, int y) const {
    int inside = 0;
    for (int k = 0; k < 64; ++k)
      inside +=
          std::hypot(x + (k % 8 + 0.5) / 8 - kAcross / 2., y + (k / 8 + 0.5) / 8 - kAcross / 2.) < radius;
    return inside / 64.;
  }
  image::Image before(const image::Image& backdrop) const {
    image::Image image = backdrop;
    for (int y = 0; y < kAcross; ++y)
      for (int x = 0; x < kAcross; ++x) {
        const auto alpha = static_cast<float>(coverage(x, y));
        const std::array<float, 3> front{disc.r, disc.g, disc.b};
        for (size_t c = 0; c < 3; ++c)
          image.at(x, y)[c] = alpha * front[c] + (1 - alpha) * backdrop.at(x, y)[c];
      }
    return image;
  }
  image::Mask mask() const {
    image::Mask mask(kAcross, kAcross);
    for (size_t i = 0; i < mask.inside.size(); ++i)
      mask.inside[i] = coverage(static_cast<int>(i) % kAcross, static_cast<int>(i) / kAcross) > 0.5;
    return mask;
  }
};

// Color times a gradient, with grain as of wood.
image::Image backdrop(Rgb color, double grain = 0) {
  image::Image image(kAcross, kAcross, 3);
  for (int y = 0; y < kAcross; ++y)
    for (int x = 0; x < kAcross; ++x) {
      const double light = (0.7 + 0.3 * x / kAcross) * (1 + grain * std::sin(0.9 * x + 0.3 * y));
      const auto factor = static_cast<float>(light);
      image.at(x, y)[0] = factor * color.r, image.at(x, y)[1] = factor * color.g,
                  image.at(x, y)[2] = factor * color.b;
    }
  return image;
}

image::Image withNoise(image::Image image, unsigned seed, double gain = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.01);
  for (float& value : image.values) {
    const double root = std::sqrt(gain * static_cast<double>(value)) + noise(random);
    value = static_cast<float>(root * std::abs(root));
  }
  return image;
}

// Every pixel of the lower third darkened to 0.4, with a soft edge.
image::Image withShadow(image::Image image) {
  for (int y = 0; y < kAcross; ++y)
    for (int x = 0; x < kAcross; ++x)
      for (float& value : image.at(x, y))
        value *= static_cast<float>(1 - 0.6 * std::clamp((y - 0.66 * kAcross) / 8, 0., 1.));
  return image;
}

image::Mask subtractedMask(const image::Image& photograph, const image::Image& plate,
                           PlateKind kind = PlateKind::photographed) {
  PlateVote vote(kAcross, kAcross);
  EXPECT_GE(vote.add(photograph, plate, kind), PlateVote::kExplained);
  EdgeCoverage edges(vote.outcome());
  edges.add(photograph, plate, kind);
  return image::objectMask(edges.outcome());
}

constexpr Rgb kBrown{0.4f, 0.25f, 0.12f}, kGray{0.3f, 0.3f, 0.3f}, kGreen{0.05f, 0.4f, 0.08f};

TEST(PlateVote, NoiseAndExposureAreNoObject) {
  const DiscScene scene;
  for (const double gain : {0.7, 1., 1.4})
    for (const Rgb color : {kBrown, kGray, kGreen}) {
      const image::Image plate = backdrop(color, 0.2);
      const image::Mask mask = subtractedMask(withNoise(scene.before(plate), 1, gain), withNoise(plate, 2));
      EXPECT_GT(image::intersectionOverUnion(mask, scene.mask()), 0.9915) << gain << " " << color.r;
    }
}

TEST(PlateVote, AnEmptySceneHasNoObject) {
  const image::Image plate = backdrop(kBrown, 0.2);
  PlateVote vote(kAcross, kAcross);
  vote.add(withNoise(plate, 1, 1.2), withNoise(plate, 2), PlateKind::photographed);
  EXPECT_EQ(vote.outcome(), image::Mask(kAcross, kAcross));
}

TEST(PlateVote, AnotherSceneIsNotCounted) {
  PlateVote vote(kAcross, kAcross);
  EXPECT_LT(
      vote.add(withNoise(backdrop(kGreen), 1), withNoise(backdrop(kBrown, 0.5), 2), PlateKind::photographed),
      PlateVote::kExplained);
}

TEST(PlateVote, ShadowsOnTextureAndOnSaturatedColourAreBackgroundButNotOnEvenGray) {
  const DiscScene scene;
  const auto overlap = [&](const image::Image& plate) {
    return image::intersectionOverUnion(
        subtractedMask(withNoise(scene.before(withShadow(plate)), 1), withNoise(plate, 2)), scene.mask());
  };
  EXPECT_GT(overlap(backdrop(kGreen)), 0.9925);
  EXPECT_GT(overlap(backdrop(kBrown, 0.3)), 0.9925);
  EXPECT_GT(overlap(backdrop(kGray, 0.3)), 0.9925);
  EXPECT_LT(overlap(backdrop(kGray)), 0.5);
}

TEST(PlateVote, AnEvenObjectOfTheTablesHueIsNoShadowOnItsTexture) {
  const DiscScene scene{.disc = {0.12f, 0.075f, 0.036f}};
  const image::Image plate = backdrop(kBrown, 0.2);
  const image::Mask mask = subtractedMask(withNoise(scene.before(plate), 1), withNoise(plate, 2));
  EXPECT_GT(image::intersectionOverUnion(mask, scene.mask()), 0.95);
}

TEST(PlateVote, PhotographsUnderOtherLightsOutvoteTheShadowOfOne) {
  const DiscScene scene;
  const image::Image plate = backdrop(kGray), photograph = scene.before(plate);
  PlateVote vote(kAcross, kAcross);
  vote.add(withNoise(scene.before(withShadow(plate)), 1), withNoise(plate, 2), PlateKind::photographed);
  for (unsigned seed : {3u, 5u})
    vote.add(withNoise(photograph, seed), withNoise(plate, seed + 1), PlateKind::photographed);
  EXPECT_GT(image::intersectionOverUnion(vote.outcome(), scene.mask()), 0.9); // without exact edges
}

// Bilinear.
image::Image enlarged(const image::Image& image, int factor) {
  image::Image large(image.width * factor, image.height * factor, image.channels);
  for (int y = 0; y < large.height; ++y)
    for (int x = 0; x < large.width; ++x) {
      const double u = std::clamp((x + 0.5) / factor - 0.5, 0., image.width - 1.),
                   v = std::clamp((y + 0.5) / factor - 0.5, 0., image.height - 1.);
      const int i = std::min(static_cast<int>(u), image.width - 2),
                j = std::min(static_cast<int>(v), image.height - 2);
      const auto a = static_cast<float>(u - i), b = static_cast<float>(v - j);
      for (size_t c = 0; c < static_cast<size_t>(image.channels); ++c)
        large.at(x, y)[c] = (1 - b) * ((1 - a) * image.at(i, j)[c] + a * image.at(i + 1, j)[c]) +
                            b * ((1 - a) * image.at(i, j + 1)[c] + a * image.at(i + 1, j + 1)[c]);
    }
  return large;
}

TEST(EdgeCoverage, AnOutlineBlurredOverFourPixelsIsTooLargeByTwoAtMost) {
  constexpr int kFactor = 4;
  const DiscScene scene;
  const image::Image plate = backdrop(kGreen, 0.2),
                     photograph = withNoise(enlarged(scene.before(plate), kFactor), 1),
                     empty = withNoise(enlarged(plate, kFactor), 2);
  PlateVote vote(photograph.width, photograph.height);
  vote.add(photograph, empty, PlateKind::photographed);
  EdgeCoverage edges(vote.outcome());
  edges.add(photograph, empty, PlateKind::photographed);
  const auto pixels = std::ranges::count(image::objectMask(edges.outcome()).inside, uint8_t{1});
  EXPECT_NEAR(std::sqrt(static_cast<double>(pixels) / std::numbers::pi), kFactor * scene.radius, 2);
}

TEST(EdgeCoverage, Cancels) {
  const DiscScene scene;
  const image::Image plate = backdrop(kBrown, 0.2), photograph = scene.before(plate);
  const Progress stopped{.cancelled = [] { return true; }};
  PlateVote vote(kAcross, kAcross);
  EXPECT_THROW(vote.add(photograph, plate, PlateKind::photographed, stopped), Cancelled);
  EXPECT_THROW(EdgeCoverage(scene.mask()).add(photograph, plate, PlateKind::photographed, stopped),
               Cancelled);
}

TEST(EdgeCoverage, IsTheShareOfThePixel) {
  const DiscScene scene;
  const image::Image plate = backdrop(kBrown, 0.2), photograph = withNoise(scene.before(plate), 1);
  PlateVote vote(kAcross, kAcross);
  vote.add(photograph, withNoise(plate, 2), PlateKind::photographed);
  EdgeCoverage edges(vote.outcome());
  edges.add(photograph, withNoise(plate, 2), PlateKind::photographed);
  const image::Image alpha = edges.outcome();
  double error = 0, pixels = 0;
  for (int y = 0; y < kAcross; ++y)
    for (int x = 0; x < kAcross; ++x) {
      const double truth = scene.coverage(x, y), difference = static_cast<double>(alpha.at(x, y)[0]) - truth;
      if (truth == 0 || truth == 1) continue;
      error += difference * difference, ++pixels;
    }
  EXPECT_LT(std::sqrt(error / pixels), 0.1);
}

TEST(FittedPlate, FollowsAnUnevenScreenBehindTheObject) {
  const DiscScene scene;
  const image::Image screen = backdrop(kGreen), photograph = withNoise(scene.before(screen), 1);
  const auto plate = fittedPlate(photograph, kGreen);
  ASSERT_TRUE(plate);
  for (int y = 0; y < kAcross; ++y)
    for (int x = 0; x < kAcross; ++x)
      EXPECT_NEAR(plate->at(x, y)[1], screen.at(x, y)[1], 0.0016) << x << " " << y;
  EXPECT_GT(image::intersectionOverUnion(subtractedMask(photograph, *plate, PlateKind::fitted), scene.mask()),
            0.9915);
}

TEST(FittedPlate, WhiteAndBlackAreKeysToo) {
  const DiscScene scene;
  for (const Rgb key : {Rgb{0.9f, 0.9f, 0.9f}, Rgb{0.001f, 0.001f, 0.001f}}) {
    const image::Image photograph = withNoise(scene.before(backdrop(key)), 1);
    const auto plate = fittedPlate(photograph, key);
    ASSERT_TRUE(plate);
    EXPECT_GT(
        image::intersectionOverUnion(subtractedMask(photograph, *plate, PlateKind::fitted), scene.mask()),
        0.9905)
        << key.r;
  }
}

TEST(FittedPlate, SeamsOfDarkClothAreBackground) {
  const DiscScene scene{.disc = {0.7f, 0.6f, 0.4f}};
  image::Image cloth = backdrop({0.002f, 0.002f, 0.002f});
  for (int y = 30; y < 50; ++y)
    for (int x = 0; x < kAcross; ++x)
      for (float& value : cloth.at(x, y)) value = 0.02f;
  const image::Image photograph = withNoise(scene.before(cloth), 1);
  const auto plate = fittedPlate(photograph, {});
  ASSERT_TRUE(plate);
  const image::Mask mask = subtractedMask(photograph, *plate, PlateKind::fitted);
  EXPECT_GT(image::intersectionOverUnion(mask, scene.mask()), 0.987);
}

TEST(FittedPlate, NeedsTheKeyColourInTheBorder) {
  EXPECT_FALSE(fittedPlate(withNoise(DiscScene{}.before(backdrop(kBrown)), 1), kGreen));
}

TEST(Spill, IsTheKeyInTheRim) {
  const DiscScene scene;
  const image::Image photograph = scene.before(backdrop(kGreen));
  EXPECT_NEAR(spillOf(photograph, scene.mask(), kGreen), 0, 1e-15);
  image::Image fringed = photograph;
  const image::Mask mask = scene.mask(), inner = image::eroded(mask, 4);
  for (size_t i = 0; i < inner.inside.size(); ++i)
    if (mask.inside[i] && !inner.inside[i]) fringed.values[3 * i + 1] += 0.2f;
  EXPECT_GT(spillOf(fringed, scene.mask(), kGreen), 0.3);
  EXPECT_EQ(spillOf(fringed, scene.mask(), kGray), 0);
}

TEST(BorderColor, IsThatOfMostOfTheBorder) {
  BorderColor border;
  for (unsigned seed = 0; seed < 3; ++seed) border.add(withNoise(DiscScene{}.before(backdrop(kGreen)), seed));
  EXPECT_GT(border.share(), 0.999);
  EXPECT_NEAR(border.color().g / border.color().r, kGreen.g / kGreen.r, 0.024);
}

} // namespace
} // namespace surflect::calibration
