#include "srf/model/pack_prepass.h"

#include "srf/weights/ulr.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace surflect::model {
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
