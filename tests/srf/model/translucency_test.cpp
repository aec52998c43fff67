#include "srf/model/translucency.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace surflect::model {
namespace {

// A disc of radius 20 whose edge is a ramp of `blur` pixels, of the given alpha inside.
image::Image disc(double blur, float inside) {
  image::Image alpha(64, 64, 1);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const double fromEdge = 20 - std::hypot(x + 0.5 - 32, y + 0.5 - 32);
      alpha.at(x, y)[0] = inside * static_cast<float>(std::clamp(fromEdge / blur + 0.5, 0., 1.));
    }
  return alpha;
}

double shareOf(const image::Image& alpha) {
  TranslucencySurvey survey;
  survey.add(alpha);
  return survey.share();
}

TEST(TranslucencySurvey, EdgesOfAnOpaqueObjectDoNotCount) {
  for (const double blur : {0.01, 1., 2.}) EXPECT_EQ(shareOf(disc(blur, 1)), 0) << blur;
  EXPECT_EQ(shareOf(image::Image(64, 64, 1)), 0);
}

TEST(TranslucencySurvey, AlphaInsideOfTheObjectCounts) {
  EXPECT_EQ(shareOf(disc(1, 0.55f)), 1);
  EXPECT_EQ(shareOf(disc(1, 0.01f)), 1);
  EXPECT_EQ(shareOf(disc(1, 0.999f)), 0); // 8 bits do not tell it from opaque; its edge is no wider
}

TEST(TranslucencySurvey, SharesArePooledOverViews) {
  TranslucencySurvey survey;
  survey.add(disc(0.01, 1));
  EXPECT_FALSE(survey.isTranslucent());
  survey.add(disc(0.01, 0.5f));
  EXPECT_NEAR(survey.share(), 0.5, 1e-9);
  EXPECT_TRUE(survey.isTranslucent());
}

} // namespace
} // namespace surflect::model
