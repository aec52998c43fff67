#include "render/stage/material/ward.h"

#include "tests/render/stage/material/zoo.h"

#include <gtest/gtest.h>

namespace surflect::material {
namespace {

TEST(Ward, AlbedoNeverExceedsItsColours) {
  for (const Roughness& alpha : {Roughness{0.02, 0.02}, {0.2, 0.2}, {1, 1}, {0.05, 0.8}})
    for (const double mu : {1.0, 0.6, 0.3, 0.1, 0.03, 0.003})
      for (const double azimuth : {0.0, 0.8, kPi / 2})
        EXPECT_LT(albedo(Ward{{0.4f, 0, 0}, {0.6f, 1, 0.3f}, alpha}, zoo::at(mu, azimuth), 1 << 14).g, 1.001)
            << alpha.x << ' ' << alpha.y << ' ' << mu;
}

// Light at grazing angles is neither lost nor created, unlike in older forms of the model.
TEST(Ward, IsNearlyWhiteWhereItIsSmooth) {
  for (const double mu : {1.0, 0.6, 0.3, 0.1})
    EXPECT_NEAR(albedo(Ward{{0, 0, 0}, {1, 1, 1}, {0.01, 0.01}}, zoo::at(mu, 1), 1 << 14).r, 1, 0.02) << mu;
}

TEST(Ward, AtTheMirroredDirectionIsItsPeak) {
  // h = n: 4 mu^2 / (pi ax ay 16 mu^4)
  for (const double mu : {1.0, 0.5, 0.2}) {
    const Rgb f = evaluate(Ward{{0, 0, 0}, {1, 1, 1}, {0.2, 0.4}}, zoo::at(mu, 1), zoo::at(mu, 1 + kPi));
    EXPECT_NEAR(f.r / mu, 1 / (4 * kPi * 0.2 * 0.4 * mu * mu), 1e-5 * f.r);
  }
}

TEST(Ward, TurningTheFrameSwapsTheRoughnesses) {
  std::mt19937 random(2);
  const auto turned = [](const ShadingDirection& w) { return ShadingDirection(-w.y(), w.x(), w.z()); };
  for (int i = 0; i < 1000; ++i) {
    const auto wi = zoo::randomDirection(random), wo = zoo::randomDirection(random);
    const float f = evaluate(Ward{{0, 0, 0}, {1, 1, 1}, {0.1, 0.5}}, wi, wo).g;
    EXPECT_NEAR(evaluate(Ward{{0, 0, 0}, {1, 1, 1}, {0.5, 0.1}}, turned(wi), turned(wo)).g, f,
                1e-6 * f + 1e-30);
  }
}

} // namespace
} // namespace surflect::material
