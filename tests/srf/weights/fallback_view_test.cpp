#include "srf/weights/fallback_view.h"

#include <gtest/gtest.h>

#include <random>

namespace surflect::weights {
namespace {

TEST(StandIn, ChangesWithoutAJumpFromTheFrontOverTheHorizonToTheBack) {
  for (const double visibility : {0.0, 0.3, 1.0}) {
    const auto at = [&](double cosine) {
      return fallbackScale(cosine, 0.7, visibility * grazingFade(cosine) * 0.7);
    };
    const double step = 1e-4;
    for (double cosine = -1; cosine + step <= 1; cosine += step)
      EXPECT_NEAR(at(cosine + step) / at(cosine), 1, 11 * step) << cosine; // exp(cosine / 0.1)
  }
}

TEST(StandIn, PrefersTheHorizonToWhatIsTurnedAwayOrHidden) {
  const float horizon = fallbackScale(0, 1, 0);
  EXPECT_FLOAT_EQ(horizon, 1 / kFallbackFade);
  EXPECT_GT(fallbackScale(-0.2, 1, 0), 5 * horizon);
  EXPECT_GT(fallbackScale(0.6, 1, 0), 100 * horizon);
  EXPECT_FLOAT_EQ(fallbackScale(0.2, 1, grazingFade(0.2)), horizon); // not occluded
  EXPECT_GT(fallbackScale(0, 0.01, 0), 99 * horizon);
}

TEST(StandIn, IsBeyondTheThresholdOfAnyBlendOfAViewThatSees) {
  for (const float light : {0.f, 0.1f, 1.f, 2.f})
    EXPECT_GE(fallbackPenalty(light, fallbackScale(0, 1, 0)), 2 * (kFallbackFrom + light));
}

TEST(StandIn, NoPenaltyIsBelowTheLeast) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> cosines(-1, 1), shares(0, 1), penalties(0, 2);
  constexpr double rounding = 2e-6;
  double tightest = 1e9;
  for (int i = 0; i < 20'000; ++i) {
    const double cosine = i % 4 == 0 ? 1e-5 * cosines(random) : cosines(random), penalty = penalties(random);
    const double border = i % 3 == 0 ? 1 : shares(random);
    const double fade = cosine > 0 && i % 2 == 0 ? shares(random) * grazingFade(cosine) * border : 0;
    const auto known = [&](double x) { return static_cast<float>(x + 0.9 * rounding * cosines(random)); };
    const float least =
        leastFallbackPenalty(known(penalty), known(cosine), fade > 0, static_cast<float>(rounding));
    const float exact = fallbackPenalty(static_cast<float>(penalty), fallbackScale(cosine, border, fade));
    EXPECT_LE(least, exact);
    tightest = std::min(tightest, double{exact / least});
  }
  EXPECT_LT(tightest, 1.01);
}

} // namespace
} // namespace surflect::weights
