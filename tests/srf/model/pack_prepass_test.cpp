#include "srf/model/pack_prepass.h"

#include "srf/weights/ulr.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

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

namespace {

codec::ReflectanceStack stackOf(int width, int height, size_t lights) {
  codec::ReflectanceStack stack{width, height,
                                std::vector<image::Image>(lights, image::Image(width, height, 3)),
                                image::Image(width, height, 1)};
  return stack;
}

TEST(WhiteLevel, OneValueInTwoHundredIsBrighter) {
  codec::ReflectanceStack stack = stackOf(100, 10, 2); // 6000 values
  image::Mask object(100, 10);
  std::ranges::fill(object.inside, uint8_t{1});
  size_t next = 0;
  for (image::Image& light : stack.lights)
    for (float& value : light.values) value = static_cast<float>(++next);
  WhiteLevel white;
  white.add(stack, object);
  EXPECT_NEAR(white.value(), 0.995 * 6000, 3); // relative precision 2^-12
}

TEST(WhiteLevel, OnlyTheObjectCounts) {
  codec::ReflectanceStack stack = stackOf(4, 4, 1);
  std::ranges::fill(stack.lights[0].values, 100.f);
  WhiteLevel white;
  image::Mask object(4, 4);
  white.add(stack, object);
  EXPECT_FALSE(white.isKnown());
  object.inside[5] = 1;
  for (size_t c = 0; c < 3; ++c) stack.lights[0].values[15 + c] = 2;
  white.add(stack, object);
  EXPECT_TRUE(white.isKnown());
  EXPECT_NEAR(white.value(), 2, 1e-3);
}

TEST(WhiteLevel, BlackHasOneNevertheless) {
  image::Mask object(4, 4);
  object.inside[0] = 1;
  WhiteLevel white;
  white.add(stackOf(4, 4, 1), object);
  EXPECT_EQ(white.value(), 1e-20);
}

} // namespace

namespace {

PackPrepass randomSurvey(std::mt19937& random) {
  std::uniform_real_distribution<double> exponent(-20, 20), db(5, 60);
  PackPrepass survey;
  survey.white = std::pow(10, exponent(random));
  survey.lights.blend = {1 + random() % weights::kMaxBlended,
                         random() % 2 ? weights::LightFit::plane : weights::LightFit::mean,
                         random() % 2 == 0};
  if (random() % 3) survey.lights.leftOutDb = db(random);
  return survey;
}

TEST(PackPrepass, ComesBackFromItsTextToTheBit) {
  std::mt19937 random(1);
  for (int i = 0; i < 1000; ++i) {
    const PackPrepass survey = randomSurvey(random);
    const auto read = parsePackPrepass(packPrepassText(survey));
    ASSERT_TRUE(read);
    EXPECT_EQ(read->white, survey.white);
    EXPECT_EQ(read->lights.blend, survey.lights.blend);
    EXPECT_EQ(read->lights.leftOutDb, survey.lights.leftOutDb);
  }
}

TEST(PackPrepass, NoPartOfATextIsASurvey) {
  std::mt19937 random(2);
  for (int i = 0; i < 100; ++i) {
    const std::string text = packPrepassText(randomSurvey(random));
    for (size_t length = 0; length < text.size(); ++length)
      EXPECT_FALSE(parsePackPrepass(text.substr(0, length))) << text.substr(0, length);
  }
}

TEST(PackPrepass, AWhiteThatCannotBeIsNone) {
  for (const double white : {0., -1., 1e-21, 1e21, std::nan(""), HUGE_VAL}) {
    PackPrepass survey;
    survey.white = white;
    EXPECT_FALSE(parsePackPrepass(packPrepassText(survey))) << white;
  }
}

} // namespace

} // namespace surflect::model
