#include "srf/model/manifest.h"

#include "srf/capture/json_fields.h"
#include "tests/srf/image/files.h"

#include <nlohmann/json.hpp>

namespace surflect::model {
namespace {

const std::string sum(16, 'a');

Manifest example() {
  return {.white = 0.7,
          .tolerance = 0.03,
          .lightBlend = {5, weights::LightFit::plane, true},
          .interpolation = {weights::Interpolation::kriging, 0.4f, true},
          .surfels = 1000,
          .views = 2,
          .lights = 3,
          .rig = sum,
          .cloud = sum,
          .visibility = sum,
          .levels = sum,
          .viewChecksums = {sum, "0123456789abcdef"}};
}

Manifest parse(const std::string& text) { return parseManifest(text, "m/manifest.json"); }
// The text with the checksum that it must have.
std::string sealed(const std::string& text) { return capture::sealedText(nlohmann::json::parse(text)); }

TEST(Manifest, WhatIsWrittenIsReadBackEqual) {
  const Manifest manifest = parse(manifestText(example()));
  EXPECT_EQ(manifest.white, 0.7);
  EXPECT_EQ(manifest.tolerance, 0.03);
  EXPECT_EQ(manifest.lightBlend, (weights::LightBlend{5, weights::LightFit::plane, true}));
  EXPECT_EQ(manifest.interpolation, example().interpolation);
  EXPECT_EQ(manifest.surfels, 1000u);
  EXPECT_EQ(manifest.views, 2u);
  EXPECT_EQ(manifest.lights, 3u);
  EXPECT_EQ(manifest.rig, sum);
  EXPECT_EQ(manifest.levels, sum);
  EXPECT_EQ(manifest.viewChecksums, example().viewChecksums);
  EXPECT_EQ(identityOf(manifest), identityOf(example()));
}

TEST(Manifest, OfAModelWithoutLevelsHasNoFieldForThem) {
  Manifest without = example();
  without.levels.clear();
  EXPECT_EQ(manifestText(without).find("levels"), std::string::npos);
  EXPECT_EQ(parse(manifestText(without)).levels, "");
  EXPECT_NE(identityOf(without), identityOf(example()));
  std::string text = manifestText(example());
  text.replace(text.find("\"levels.bin\": \"") + 14, 18, "7");
  EXPECT_NE(image::errorOf([&] { parse(sealed(text)); }).find("levels.bin: found 7, expected a string"),
            std::string::npos);
}

TEST(Manifest, OfATranslucentObjectHasChecksumsOfItsAlphaAndAVersionOfItsOwn) {
  EXPECT_NE(manifestText(example()).find("\"version\": 5"), std::string::npos);
  EXPECT_EQ(manifestText(example()).find("alpha"), std::string::npos);
  Manifest translucent = example();
  translucent.alphaChecksums = {sum, sum};
  const std::string text = manifestText(translucent);
  EXPECT_NE(text.find("\"version\": 6"), std::string::npos);
  EXPECT_EQ(parse(text).alphaChecksums, translucent.alphaChecksums);
  EXPECT_NE(identityOf(translucent), identityOf(example()));
}

TEST(Manifest, AlphaOfOtherThanAllViewsIsRefused) {
  Manifest translucent = example();
  translucent.alphaChecksums = {sum};
  EXPECT_EQ(image::errorOf([&] { parse(manifestText(translucent)); }),
            "m/manifest.json: alpha_checksums: found 1, expected 2 entries");
  std::string text = manifestText(example());
  text.replace(text.find("\"version\": 5"), 12, "\"version\": 6");
  EXPECT_EQ(image::errorOf([&] { parse(sealed(text)); }),
            "m/manifest.json: alpha_checksums: found nothing, expected a list");
  text.replace(text.find("\"version\": 6"), 12, "\"version\": 9");
  EXPECT_EQ(image::errorOf([&] { parse(text); }),
            "m/manifest.json: version: found 9, expected 5 or 6 or 7 or 8");
}

TEST(Manifest, TablesAreOfVersion7) {
  Manifest withTables = example();
  withTables.tables = sum;
  withTables.interpolation.kind = weights::Interpolation::shared;
  withTables.interpolation.otherwise = weights::Interpolation::separate;
  std::string text = manifestText(withTables);
  EXPECT_NE(text.find("\"version\": 7"), std::string::npos);
  EXPECT_EQ(parse(text).tables, sum);
  EXPECT_EQ(parse(text).interpolation, withTables.interpolation);
  text.replace(text.find("\"version\": 7"), 12, "\"version\": 5");
  EXPECT_EQ(image::errorOf([&] { parse(sealed(text)); }),
            "m/manifest.json: interpolation shared: found 5, expected version 7");
}

TEST(Manifest, AnyFieldChangesTheIdentity) {
  Manifest other = example();
  other.viewChecksums[1][3] = 'f';
  EXPECT_NE(identityOf(other), identityOf(example()));
  other = example();
  other.white = 0.71;
  EXPECT_NE(identityOf(other), identityOf(example()));
}

TEST(Manifest, AChangedDigitIsToldByTheChecksum) {
  std::string text = manifestText(example());
  text.replace(text.find("1000"), 4, "1001");
  EXPECT_NE(image::errorOf([&] { parse(text); }).find("m/manifest.json: checksum: found "),
            std::string::npos);
}

TEST(Manifest, ALightBlendThatCannotBeIsRefused) {
  for (const size_t lights : {size_t{0}, weights::kMaxBlended + 1}) {
    Manifest wrong = example();
    wrong.lightBlend.lights = lights;
    EXPECT_NE(image::errorOf([&] { parse(manifestText(wrong)); }).find("light_blend.lights: found "),
              std::string::npos);
  }
  std::string text = manifestText(example());
  text.replace(text.find("\"plane\""), 7, "\"curve\"");
  EXPECT_NE(image::errorOf([&] { parse(sealed(text)); }).find("light_blend.fit: found \"curve\""),
            std::string::npos);
  text = manifestText(example());
  text.replace(text.find("\"foreshortened\": true"), 21, "\"foreshortened\": null");
  EXPECT_NE(image::errorOf([&] { parse(sealed(text)); }).find("light_blend.foreshortened: found nothing"),
            std::string::npos);
}

TEST(Manifest, AnInterpolationThatCannotBeIsRefused) {
  const auto complaint = [](const std::string& from, const std::string& to) {
    std::string text = manifestText(example());
    text.replace(text.find(from), from.size(), to);
    return image::errorOf([&] { parse(sealed(text)); });
  };
  EXPECT_NE(complaint("\"kriging\"", "\"paper\"")
                .find("interpolation.kind: found \"paper\", expected "
                      "\"separate\" or \"kriging\""),
            std::string::npos);
  EXPECT_NE(complaint("\"half_scale\": 0.4", "\"half_scale\": 0")
                .find("interpolation.half_scale: found 0, expected a number from 0.01 to 100"),
            std::string::npos);
  EXPECT_NE(complaint("\"reciprocal\": true", "\"reciprocal\": 1").find("interpolation.reciprocal: found 1"),
            std::string::npos);
}

// Models of earlier versions state no interpolation.
TEST(Manifest, WithoutAnInterpolationCamerasAndLightsAreWeightedApart) {
  Manifest plain = example();
  plain.interpolation = {};
  EXPECT_EQ(parse(manifestText(plain)).interpolation, weights::InterpolationChoice{});
}

TEST(Manifest, WhatIsNoManifestIsRefusedInOneLine) {
  std::string deep = "{\"view_checksums\": ";
  for (int i = 0; i < 1000000; ++i) deep += "[";
  for (const std::string& text : {std::string(), std::string("[]"), std::string("{}"), deep,
                                  std::string("{\"format\": \"surflect model\", \"version\": 99}")})
    EXPECT_NE(image::errorOf([&] { parse(text); }).find("m/manifest.json"), std::string::npos);
}

} // namespace
} // namespace surflect::model
