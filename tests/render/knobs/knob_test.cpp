#include "render/knobs/knob.h"

#include "tests/srf/image/files.h"

namespace surflect::knobs {
namespace {

TEST(Knob, ASettingIsWrittenAsItIsGiven) {
  EXPECT_EQ(textOf({}), "full");
  EXPECT_EQ(textOf({{"lights", 2}, {"cameras", 1}, {"surfel_size", 0.5}}),
            "cameras=1 lights=2 surfel_size=0.5");
}

TEST(Knob, ValuesAreParsedInTheirOrder) {
  const auto [name, values] = parseKnobValues("surfel_size=2,0.5,1e-1");
  EXPECT_EQ(name, "surfel_size");
  EXPECT_EQ(values, (std::vector<double>{2, 0.5, 0.1}));
}

TEST(Knob, WhatIsNotValuesIsTold) {
  for (const char* text :
       {"", "=", "a", "a=", "=1", "a=1,", "a=,1", "a=1;2", "a=nan", "a=inf", "a=1 2", "a=x"})
    EXPECT_EQ(image::errorOf([&] { parseKnobValues(text); }),
              "--knob: found '" + std::string(text) + "', expected NAME=VALUE, or NAME=V1,V2,..");
}

TEST(Knob, OnlyKnobsOfTheRendererCanBeSet) {
  const std::vector<Knob> knobs{{"cameras", "", {3, 1}}, {"lights", "", {4, 1}}};
  requireKnobs(knobs, {{"lights", 1}});
  EXPECT_EQ(image::errorOf([&] {
              requireKnobs(knobs, {{"light", 1}});
            }),
            "knob: found 'light', expected one of cameras, lights");
  EXPECT_EQ(image::errorOf([&] {
              requireKnobs({}, {{"light", 1}});
            }),
            "knob: found 'light', expected no knob: the renderer has none");
}

} // namespace
} // namespace surflect::knobs
