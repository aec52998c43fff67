#include "srf/query/stand_in.h"

#include <gtest/gtest.h>

namespace surflect {
namespace {

TEST(StandIn, ChangesWithoutAJumpFromTheFrontOverTheHorizonToTheBack) {
  for (const double openness : {0.0, 0.3, 1.0}) {
    const auto at = [&](double cosine) {
      return standInScale(cosine, 0.7, openness * grazingFade(cosine) * 0.7);
    };
    const double step = 1e-4;
    for (double cosine = -1; cosine + step <= 1; cosine += step)
      EXPECT_NEAR(at(cosine + step) / at(cosine), 1, 11 * step) << cosine; // exp(cosine / 0.1)
  }
}

TEST(StandIn, PrefersTheHorizonToWhatIsTurnedAwayOrHidden) {
  const float horizon = standInScale(0, 1, 0);
  EXPECT_FLOAT_EQ(horizon, 1 / kStandInFade);
  EXPECT_GT(standInScale(-0.2, 1, 0), 5 * horizon);
  EXPECT_GT(standInScale(0.6, 1, 0), 100 * horizon);
  EXPECT_FLOAT_EQ(standInScale(0.2, 1, grazingFade(0.2)), horizon); // nothing is before it
  EXPECT_GT(standInScale(0, 0.01, 0), 99 * horizon);
}

TEST(StandIn, IsBeyondTheThresholdOfAnyBlendOfAViewThatSees) {
  for (const float light : {0.f, 0.1f, 1.f, 2.f})
    EXPECT_GE(standInPenalty(light, standInScale(0, 1, 0)), 2 * (kStandInFrom + light));
}

} // namespace
} // namespace surflect
