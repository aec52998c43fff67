#include "render/method/option.h"

#include "surfel/base/error.h"
#include "tests/srf/image/files.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace surflect::method {
namespace {

const std::vector<Option>& lookRows() {
  static const std::vector<Option> kRows{
      {.name = "surfel_size",
       .domain = Range{0, 64},
       .standard = 0,
       .preview = 0.7,
       .sweep = {0, 0.5, 1},
       .help = "pixels"},
      {.name = "cameras", .domain = wholeRange(1, 12), .standard = 3, .paper = 4, .help = "cameras"},
      {.name = "level", .domain = Range{0, 3}, .help = "no default"},
      {.name = "order",
       .domain = std::vector<Value>{"list", "peel"},
       .standard = "list",
       .paper = "peel",
       .help = "order",
       .atOpening = true},
      {.name = "layers",
       .domain = wholeRange(1, 64),
       .standard = 64,
       .help = "layers",
       .needs = {{"order", {"peel"}}}},
      {.name = "depth",
       .domain = std::vector<Value>{kOn, kOff},
       .standard = kOn,
       .preview = kOff,
       .sweep = {kOn, kOff},
       .help = "depth"},
      {.name = "size", .domain = std::vector<Value>{6, 18, 66}, .standard = 18, .help = "some numbers"}};
  return kRows;
}
const Options kOptions{"look", lookRows()};

const Option& named(const char* name) { return rowOf(kOptions, name); }

std::string complaint(const Setting& setting) {
  return image::errorOf([&] { requireSetting(kOptions, setting); });
}

TEST(Value, IsANumberOrAWord) {
  EXPECT_TRUE(Value(0.05).isNumber());
  EXPECT_EQ(Value(0.05).number(), 0.05);
  EXPECT_EQ(Value(0.05).text(), "0.05");
  EXPECT_EQ(Value(3).text(), "3");
  EXPECT_FALSE(Value("peel").isNumber());
  EXPECT_TRUE(std::isnan(Value("peel").number()));
  EXPECT_EQ(Value("peel").text(), "peel");
  EXPECT_EQ(Value(3), Value(size_t{3}));
  EXPECT_NE(Value(3), Value("3"));
}

TEST(Option, NumbersComeBackToTheBitFromTheirTexts) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 64);
  for (int i = 0; i < 1000; ++i) {
    const Value value = uniform(random);
    EXPECT_EQ(parseValue(named("surfel_size"), value.text()), value);
  }
}

TEST(Option, WordsComeBackFromTheirTexts) {
  for (const char* name : {"order", "depth", "size"})
    for (const Value& value : std::get<std::vector<Value>>(named(name).domain))
      EXPECT_EQ(parseValue(named(name), value.text()), value);
}

TEST(Option, ASwitchIsOnOrOff) {
  EXPECT_TRUE(named("depth").isSwitch());
  EXPECT_FALSE(named("order").isSwitch());
  EXPECT_FALSE(named("cameras").isSwitch());
}

TEST(Option, AFlagIsFoundByItsNameAndAsItIsTyped) {
  EXPECT_EQ(flagOf("surfel_size"), "--surfel-size");
  for (const char* text : {"surfel_size", "surfel-size", "--surfel-size"})
    EXPECT_EQ(rowOf(kOptions, text).name, "surfel_size");
}

TEST(Option, DomainsAreWrittenInWords) {
  EXPECT_EQ(domainText(named("surfel_size")), "0..64");
  EXPECT_EQ(domainText(named("cameras")), "1..12, whole");
  EXPECT_EQ(domainText(named("order")), "list or peel");
  EXPECT_EQ(domainText(named("size")), "6, 18 or 66");
}

TEST(Option, AValueOutsideOfTheDomainIsRefusedByName) {
  const auto parsing = [](const char* name, const char* text) {
    return image::errorOf([&] { parseValue(named(name), text); });
  };
  EXPECT_EQ(parsing("surfel_size", "64.5"), "--surfel-size: found 64.5, expected 0..64");
  EXPECT_EQ(parsing("surfel_size", "-1"), "--surfel-size: found -1, expected 0..64");
  EXPECT_EQ(parsing("cameras", "1.5"), "--cameras: found 1.5, expected 1..12, whole");
  EXPECT_EQ(parsing("cameras", "many"), "--cameras: found many, expected 1..12, whole");
  EXPECT_EQ(parsing("order", "bsp"), "--order: found bsp, expected list or peel");
  EXPECT_EQ(parsing("size", "7"), "--size: found 7, expected 6, 18 or 66");
  for (const char* text : {"", " 1", "1 ", "1;2", "0x1", "nan", "inf", "1e999", "+1"})
    EXPECT_THROW(parseValue(named("surfel_size"), text), Error) << text;
  EXPECT_EQ(complaint({{"cameras", 13}}), "--cameras: found 13, expected 1..12, whole");
  EXPECT_EQ(complaint({{"cameras", std::nan("")}}), "--cameras: found nan, expected 1..12, whole");
}

TEST(Option, AnUnknownOptionNamesTheMethodAndTheNearestOption) {
  EXPECT_EQ(complaint({{"layer", 1}}), "look has no option --layer; did you mean --layers?");
  EXPECT_EQ(image::errorOf([&] { rowOf(kOptions, "--surfelsize"); }),
            "look has no option --surfelsize; did you mean --surfel-size?");
  EXPECT_EQ(image::errorOf([&] { rowOf({"bare", {}}, "layers"); }), "bare has no option --layers");
}

TEST(Option, WithoutWhatItNeedsAnOptionIsRefused) {
  const std::string error = "--layers: has an effect only with --order peel, found list";
  EXPECT_EQ(complaint({{"layers", 2}}), error);
  EXPECT_EQ(complaint({{"layers", 2}, {"order", "list"}}), error);
  EXPECT_NO_THROW(requireSetting(kOptions, {{"layers", 2}, {"order", "peel"}}));
}

TEST(Option, DefaultsCanBeAddedAndLeftOut) {
  EXPECT_EQ(withDefaults(lookRows(), {}).size(), 6u) << "the level has none";
  EXPECT_EQ(withDefaults(lookRows(), {{"cameras", 1}}).at("cameras"), Value(1));
  EXPECT_EQ(withoutDefaults(lookRows(), withDefaults(lookRows(), {})), Setting());
  for (const Setting& setting : {Setting{{"cameras", 1}},
                                 {{"cameras", 3}},
                                 {{"order", "peel"}, {"layers", 2}},
                                 {{"level", 1}, {"depth", kOff}}}) {
    EXPECT_EQ(withoutDefaults(lookRows(), withDefaults(lookRows(), setting)),
              withoutDefaults(lookRows(), setting));
    EXPECT_EQ(withDefaults(lookRows(), withoutDefaults(lookRows(), setting)),
              withDefaults(lookRows(), setting));
  }
  EXPECT_EQ(forFrames(lookRows(), {{"order", "peel"}, {"cameras", 2}}), (Setting{{"cameras", 2}}));
}

TEST(Option, ASettingIsWrittenAsItIsGiven) {
  EXPECT_EQ(textOf({}), "full");
  EXPECT_EQ(textOf({{"surfel_size", 0.5}, {"cameras", 1}, {"order", "peel"}}),
            "cameras=1 order=peel surfel_size=0.5");
}

TEST(Option, PresetsHoldWhatDiffersFromTheDefault) {
  EXPECT_EQ(settingOf(Preset::full, lookRows()), Setting());
  EXPECT_EQ(settingOf(Preset::preview, lookRows()), (Setting{{"depth", kOff}, {"surfel_size", 0.7}}));
  EXPECT_EQ(settingOf(Preset::paper, lookRows()), (Setting{{"cameras", 4}, {"order", "peel"}}));
}

TEST(Option, GivenValuesWinOverThoseOfAPreset) {
  EXPECT_EQ(withPreset({{"cameras", 2}}, Preset::paper, lookRows()),
            (Setting{{"cameras", 2}, {"order", "peel"}}));
  EXPECT_EQ(withPreset({}, Preset::full, lookRows()), Setting());
}

TEST(Option, ValuesOfAPresetThatHaveNoEffectBesideTheGivenOnesAreLeftOut) {
  std::vector<Option> rows = lookRows();
  rows[4].paper = 8; // layers, which need --order peel
  EXPECT_EQ(withPreset({}, Preset::paper, rows), (Setting{{"cameras", 4}, {"layers", 8}, {"order", "peel"}}));
  const Setting lists = withPreset({{"order", "list"}}, Preset::paper, rows);
  EXPECT_EQ(lists, (Setting{{"cameras", 4}, {"order", "list"}}));
  requireSetting({"look", rows}, lists);
}

TEST(Option, ValuesToSweepAreParsedInTheirOrder) {
  const Sweep sweep = parseSweep(kOptions, "surfel-size=2,0.5,1e-1");
  EXPECT_EQ(sweep.name, "surfel_size");
  EXPECT_EQ(sweep.values, (std::vector<Value>{2, 0.5, 0.1}));
  EXPECT_EQ(parseSweep(kOptions, "order=peel").values, (std::vector<Value>{"peel"}));
}

TEST(Option, WhatIsNoSweepIsToldSo) {
  for (const char* text : {"", "=", "cameras", "cameras=", "=1"})
    EXPECT_EQ(image::errorOf([&] { parseSweep(kOptions, text); }),
              "--sweep: found '" + std::string(text) + "', expected NAME=VALUE, or NAME=V1,V2,..");
  for (const char* text : {"cameras=1,", "cameras=,1", "cameras=1;2", "cameras=1 2", "cameras=0", "camera=1"})
    EXPECT_THROW(parseSweep(kOptions, text), Error) << text;
}

} // namespace
} // namespace surflect::method
