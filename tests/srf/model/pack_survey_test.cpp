#include "srf/model/pack_survey.h"

#include "srf/ulr/ulr.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace surflect::model {
namespace {

PackSurvey randomSurvey(std::mt19937& random) {
  std::uniform_real_distribution<double> exponent(-20, 20), db(5, 60);
  PackSurvey survey;
  survey.white = std::pow(10, exponent(random));
  survey.lights.blend = {1 + random() % ulr::kMaxBlended,
                         random() % 2 ? ulr::LightFit::plane : ulr::LightFit::mean, random() % 2 == 0};
  if (random() % 3) survey.lights.leftOutDb = db(random);
  return survey;
}

TEST(PackSurvey, ComesBackFromItsTextToTheBit) {
  std::mt19937 random(1);
  for (int i = 0; i < 1000; ++i) {
    const PackSurvey survey = randomSurvey(random);
    const auto read = parsePackSurvey(packSurveyText(survey));
    ASSERT_TRUE(read);
    EXPECT_EQ(read->white, survey.white);
    EXPECT_EQ(read->lights.blend, survey.lights.blend);
    EXPECT_EQ(read->lights.leftOutDb, survey.lights.leftOutDb);
  }
}

TEST(PackSurvey, NoPartOfATextIsASurvey) {
  std::mt19937 random(2);
  for (int i = 0; i < 100; ++i) {
    const std::string text = packSurveyText(randomSurvey(random));
    for (size_t length = 0; length < text.size(); ++length)
      EXPECT_FALSE(parsePackSurvey(text.substr(0, length))) << text.substr(0, length);
  }
}

TEST(PackSurvey, AWhiteThatCannotBeIsNone) {
  for (const double white : {0., -1., 1e-21, 1e21, std::nan(""), HUGE_VAL}) {
    PackSurvey survey;
    survey.white = white;
    EXPECT_FALSE(parsePackSurvey(packSurveyText(survey))) << white;
  }
}

} // namespace
} // namespace surflect::model
