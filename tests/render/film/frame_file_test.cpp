#include "render/film/frame_file.h"

#include "srf/image/exr.h"
#include "surfel/base/file.h"
#include "tests/srf/image/files.h"

#include <algorithm>
#include <limits>

namespace surflect::film {
namespace {

method::FrameLayers randomFilm() {
  method::FrameLayers film;
  film.color = image::randomImage(13, 9, 4, 0, 2, 1);
  film.aovs["depth"] = image::randomImage(13, 9, 1, 1, 5, 2);
  film.aovs["depth"].at(3, 4)[0] = std::numeric_limits<float>::infinity();
  film.aovs["normal"] = image::randomImage(13, 9, 3, -1, 1, 3);
  film.aovs["position"] = image::randomImage(13, 9, 3, 1000, 1001, 7);
  film.aovs["rest"] = image::randomImage(13, 9, 3, -1, 1, 8);
  film.aovs["camera_blend"] = image::randomImage(13, 9, 3, 0, 1, 4);
  film.aovs["light_blend"] = image::randomImage(13, 9, 3, 0, 1, 5);
  film.aovs["stretch"] = image::randomImage(13, 9, 1, 1, 3, 6);
  return film;
}

TEST(FrameLayers, WhatLiesBelowBlackIsBlack) {
  const image::TemporaryFolder folder;
  method::FrameLayers film;
  film.color = image::Image(2, 1, 4);
  film.color.values = {-0.5f, 0.25f, -1e-9f, 1, 0.5f, -2, 1, 1};
  writeFrame(folder / "film.exr", film, {});
  EXPECT_EQ(image::ExrFile(folder / "film.exr").read(image::ChannelSet{"R", "G", "B", "A"}).values,
            (std::vector<float>{0, 0.25f, 0, 1, 0.5f, 0, 1, 1}));
}

TEST(FrameLayers, LayersAndMetadataComeBack) {
  const image::TemporaryFolder folder;
  const method::FrameLayers film = randomFilm();
  writeFrame(folder / "film.exr", film, {{"surflect.identity", "script 1 model 2"}, {"surflect.frame", "7"}});
  const image::ExrFile file(folder / "film.exr");
  EXPECT_EQ(file.attribute("surflect.identity"), "script 1 model 2");
  EXPECT_EQ(file.attribute("surflect.frame"), "7");
  EXPECT_EQ(file.channels().size(), 4u + 1 + 3 + 3 + 3 + 3 + 3 + 1);

  const auto isBack = [&](const image::ChannelSet& channels, const image::Image& wanted, float relative) {
    const image::Image got = file.read(channels);
    ASSERT_EQ(got.values.size(), wanted.values.size());
    for (size_t i = 0; i < got.values.size(); ++i)
      EXPECT_LE(std::abs(got.values[i] - wanted.values[i]), relative * std::abs(wanted.values[i]) + 3e-8f);
  };
  constexpr float half = 1.f / 2048; // 11 bits
  isBack({"R", "G", "B", "A"}, film.color, half);
  isBack({"normal.X", "normal.Y", "normal.Z"}, film.aovs.at("normal"), half);
  for (const std::string blend : {"camera_blend", "light_blend"})
    isBack({blend + ".R", blend + ".G", blend + ".B"}, film.aovs.at(blend), half);
  isBack({"stretch.V"}, film.aovs.at("stretch"), half);
  for (const std::string place : {"position", "rest"})
    EXPECT_EQ(file.read(image::ChannelSet{place + ".X", place + ".Y", place + ".Z"}).values,
              film.aovs.at(place).values);
  EXPECT_EQ(file.read(image::ChannelSet{"depth.Z"}).values,
            film.aovs.at("depth").values); // with its infinity
}

TEST(FrameLayers, AShadowLiesBehindInAlphaAndIsALayerOfItsOwn) {
  const image::TemporaryFolder folder;
  method::FrameLayers film;
  film.color = image::Image(4, 1, 4);
  film.color.values = {0.5f, 0.25f, 0, 0.5f, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0};
  film.shadow = image::Image(4, 1, 1);
  film.shadow.values = {0.25f, 0, 0.75f, 0};
  writeFrame(folder / "film.exr", film, {});
  const image::ExrFile file(folder / "film.exr");
  EXPECT_EQ(file.read(image::ChannelSet{"A"}).values, (std::vector<float>{0.75f, 1, 0.75f, 0}));
  EXPECT_EQ(file.read(image::ChannelSet{"shadow.V"}).values, film.shadow.values);
  const method::FrameLayers back = readFrame(folder / "film.exr");
  EXPECT_EQ(back.color.values, film.color.values);
  EXPECT_EQ(back.shadow.values, film.shadow.values);
  EXPECT_EQ(overShadow(film).values, file.read(image::ChannelSet{"R", "G", "B", "A"}).values);
}

// Both are rounded to 11 bits.
TEST(FrameLayers, TheObjectsAlphaComesBackFromUnderItsShadow) {
  const image::TemporaryFolder folder;
  method::FrameLayers film = randomFilm();
  film.shadow = image::randomImage(13, 9, 1, 0, 1, 9);
  for (size_t i = 0; i < film.shadow.values.size(); ++i) {
    float& alpha = film.color.values[4 * i + 3];
    alpha = std::min(alpha, 1.f);
    film.shadow.values[i] *= 1 - alpha;
  }
  writeFrame(folder / "film.exr", film, {});
  const method::FrameLayers back = readFrame(folder / "film.exr");
  for (size_t i = 0; i < film.shadow.values.size(); ++i) {
    EXPECT_NEAR(back.color.values[4 * i + 3], film.color.values[4 * i + 3], 0x1p-11f);
    EXPECT_NEAR(back.shadow.values[i], film.shadow.values[i], 0x1p-12f);
  }
}

TEST(FrameLayers, SameFilmSameBytes) {
  const image::TemporaryFolder folder;
  writeFrame(folder / "a.exr", randomFilm(), {{"surflect.frame", "7"}});
  writeFrame(folder / "b.exr", randomFilm(), {{"surflect.frame", "7"}});
  EXPECT_EQ(readFile(folder / "a.exr"), readFile(folder / "b.exr"));
}

TEST(WhiteOf, IsThe995thPercentileOfTheObject) {
  // A thousand object pixels: in each, channels 3 i, 3 i + 1, 3 i + 2 of 0..2999; and bright ones outside.
  image::Image color(60, 20, 4);
  for (size_t i = 0; i < 1200; ++i) {
    const bool isObject = i % 6 != 5;
    const size_t rank = 3 * (i / 6 * 5 + i % 6);
    for (size_t c = 0; c < 3; ++c) color.values[4 * i + c] = isObject ? static_cast<float>(rank + c) : 1e6f;
    color.values[4 * i + 3] = isObject ? 0.6f : 0.5f;
  }
  EXPECT_NEAR(whiteOf(color), 2984, 2984 * 0x1p-12); // floor(0.995 * 2999)
}

TEST(WhiteOf, IsZeroWhereThereIsNothingToSee) {
  EXPECT_EQ(whiteOf(image::Image(4, 4, 4)), 0);
  image::Image black(4, 4, 4);
  for (size_t i = 3; i < black.values.size(); i += 4) black.values[i] = 1;
  EXPECT_EQ(whiteOf(black), 0);
}

} // namespace
} // namespace surflect::film
