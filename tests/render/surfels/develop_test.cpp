#include "render/surfels/develop.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace surflect::surfels {
namespace {

using Color = std::array<float, 4>;

// Premultiplied.
Color randomColor(std::mt19937& random) {
  std::uniform_real_distribution<float> unit(0, 1);
  const float alpha = unit(random);
  return {alpha * unit(random), alpha * unit(random), alpha * unit(random), alpha};
}

TEST(PixelComposite, LayersThatAreNewAreCompositedByOver) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 20; ++trial) {
    PixelComposite pixel;
    Color over{};
    for (int layer = 0; layer < 5; ++layer) {
      const Color color = randomColor(random);
      const float through = 1 - over[3];
      for (size_t k = 0; k < 4; ++k) over[k] += through * color[k];
      pixel.add(color, layer == 0 ? 1.f : 0.f, layer == 0 ? 0.f : 1.f);
    }
    for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(pixel.color[k], over[k], 1e-6);
  }
}

TEST(PixelComposite, LayersThatShareThePixelAddUp) {
  PixelComposite pixel;
  pixel.add({0.2f, 0, 0, 0.4f}, 0.3f, 0);
  pixel.add({0, 0.6f, 0, 0.8f}, 0.7f, 0);
  EXPECT_NEAR(pixel.color[0], 0.06, 1e-7);
  EXPECT_NEAR(pixel.color[1], 0.42, 1e-7);
  EXPECT_NEAR(pixel.color[3], 0.68, 1e-7);
  EXPECT_NEAR(pixel.covered, 1, 1e-7);
}

TEST(PixelComposite, KnownLayersChangeNothingAndOpaqueOnesHideAllBehindThem) {
  PixelComposite pixel;
  pixel.add({0.1f, 0.2f, 0.3f, 0.55f}, 1, 0);
  pixel.add({1, 1, 1, 1}, 0, 0);
  EXPECT_EQ(pixel.color, (Color{0.1f, 0.2f, 0.3f, 0.55f}));
  pixel.add({0, 0, 0, 1}, 0, 1);
  EXPECT_NEAR(pixel.color[3], 1, 1e-6);
  const Color before = pixel.color;
  pixel.add({1, 1, 1, 1}, 0, 1);
  for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(pixel.color[k], before[k], 1e-6);
}

TEST(PixelComposite, ManyThinStrandsCoverOneMinusTheExponentialOfTheirSum) {
  for (const double depth : {0.2, 1., 3.}) {
    constexpr int strands = 4096;
    const auto alpha = static_cast<float>(depth / strands);
    PixelComposite pixel;
    for (int i = 0; i < strands; ++i)
      pixel.add({alpha, alpha, alpha, alpha}, i == 0 ? 1.f : 0.f, i == 0 ? 0.f : 1.f);
    // The product differs from the exponential by depth^2 / (2 strands) exp(-depth), here at most 1e-4.
    EXPECT_NEAR(pixel.color[3], 1 - std::exp(-depth), 2e-4) << depth;
  }
}

TEST(Novelty, WhatLayBehindAtRestIsKnownAndWhatLayElsewhereIsNew) {
  const Vec3<float> front(1, 2, 3), towards = Vec3<float>(1, 2, 2) / 3, aside = Vec3<float>(2, -2, 1) / 3;
  const auto at = [&](float along, float off) {
    return novelty(front, towards, front - along * towards + off * aside, 0.01f);
  };
  EXPECT_EQ(at(1, 0), 0);
  EXPECT_EQ(at(100, 0), 0);
  EXPECT_EQ(at(1, 0.1f), 0);   // 6 degrees aside
  EXPECT_EQ(at(1, 1), 1);      // 45 degrees
  EXPECT_EQ(at(-1, 0), 1);     // it lay in front
  EXPECT_EQ(at(0, 0), 0);      // one place
  EXPECT_EQ(at(0, 0.002f), 0); // one sheet: well within the clearance
  EXPECT_EQ(novelty(front, towards, front, 0), 0);
}

TEST(Novelty, RisesSteadilyWithTheAngle) {
  const Vec3<float> towards(0, 0, 1);
  float last = 0;
  for (int degrees = 0; degrees <= 90; ++degrees) {
    const auto angle = static_cast<float>(degrees) * 3.14159265f / 180;
    const float here =
        novelty(Vec3<float>::Zero(), towards, Vec3<float>(std::sin(angle), 0, -std::cos(angle)), 0);
    EXPECT_GE(here, last) << degrees;
    EXPECT_LE(here - last, 0.09f) << degrees; // steepest slope of the step, 1.5 / 0.33 per unit of sine
    last = here;
  }
  EXPECT_EQ(last, 1);
}

} // namespace
} // namespace surflect::surfels
