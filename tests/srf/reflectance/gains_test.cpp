#include "srf/reflectance/gains.h"

#include "tests/srf/reflectance/planted.h"

#include <gtest/gtest.h>

namespace surflect::reflectance {
namespace {

TEST(Gains, RecoverPlantedGains) {
  std::mt19937 random(1);
  PhotographArrays captured;
  std::vector<Rgb> gains, predicted;
  for (int surfel = 0; surfel < 50; ++surfel) {
    gains.push_back(planted::randomGain(random));
    const size_t begin = captured.reflectance.size();
    planted::addSurfel(captured, planted::kGlossy, {1, 1, 1}, 400, random);
    for (size_t i = begin; i < captured.reflectance.size(); ++i) {
      predicted.push_back(captured.reflectance[i]);
      captured.reflectance[i] = gains.back() * predicted.back();
    }
  }
  const auto found = gainsOf(captured.view(), predicted, planted::kWhite);
  for (size_t s = 0; s < gains.size(); ++s) {
    EXPECT_NEAR(found[s].r / gains[s].r, 1, 0.0065);
    EXPECT_NEAR(found[s].b / gains[s].b, 1, 0.0065);
  }
}

TEST(Gains, AreOneWithoutPhotographsAndStayNearItWithFew) {
  GainSums sums(planted::kWhite);
  EXPECT_EQ(sums.gain(), (Rgb{1, 1, 1}));
  sums.add({0.02f, 0.02f, 0}, {0.01f, 0.01f, 0.01f}); // twice as bright, but dark
  EXPECT_GT(sums.gain().r, 1);
  EXPECT_LT(sums.gain().r, 1.1f);
  EXPECT_LT(sums.gain().b, 1);
}

TEST(Gains, AreBounded) {
  GainSums bright(planted::kWhite), dark(planted::kWhite);
  for (int i = 0; i < 100000; ++i) {
    bright.add({0.3f, 0.3f, 0.3f}, {0.001f, 0.001f, 0.001f});
    dark.add({0, 0, 0}, {1, 1, 1});
  }
  EXPECT_EQ(bright.gain().r, kGreatestGain);
  EXPECT_EQ(dark.gain().g, kLeastGain);
}

TEST(Gains, DependOnTheWhitePixelOnlyAsAUnit) {
  GainSums one(1), small(0.25f);
  one.add({1, 0.5f, 0.25f}, {0.5f, 0.5f, 0.5f});
  small.add({0.25f, 0.125f, 0.0625f}, {0.125f, 0.125f, 0.125f});
  EXPECT_EQ(one.gain(), small.gain());
}

TEST(Gains, WithoutAPhotographAreThoseOfTheOthers) {
  std::mt19937 random(2);
  std::uniform_real_distribution<float> value(0, 1);
  GainSums others(planted::kWhite), all(planted::kWhite);
  for (int i = 0; i < 10; ++i) {
    const Rgb y{value(random), value(random), value(random)}, t{value(random), value(random), value(random)};
    others.add(y, t);
    all.add(y, t);
  }
  const Rgb y{1, 0, 0.5f}, t{0.2f, 0.6f, 0.5f};
  all.add(y, t);
  EXPECT_NEAR(all.gainWithout(y, t).r, others.gain().r, 1e-6);
  EXPECT_NEAR(all.gainWithout(y, t).g, others.gain().g, 1e-6);
}

TEST(Gains, LeftOutErrorIsZeroForAnExactTableAndGrowsWithWrongShape) {
  std::mt19937 random(3);
  PhotographArrays captured;
  planted::addSurfel(captured, planted::kGlossy, {1, 1, 1}, 100, random);
  planted::addSurfel(captured, planted::kGlossy, {1, 1, 1}, 100, random);
  planted::addSurfel(captured, planted::kGlossy, {1, 1, 1}, 0, random);
  std::vector<Rgb> predicted = captured.reflectance;
  for (size_t i = 100; i < 200; ++i) predicted[i] = {0.1f, 0.1f, 0.1f};
  const auto errors = leftOutErrors(captured.view(), predicted, planted::kWhite);
  EXPECT_NEAR(errors[0], 0, 1e-9);
  EXPECT_GT(errors[1], 0.3f);
  EXPECT_EQ(errors[2], 0);
}

} // namespace
} // namespace surflect::reflectance
