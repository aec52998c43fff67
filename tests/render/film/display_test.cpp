#include "render/film/display.h"

#include "srf/image/color.h"
#include "srf/image/png.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"
#include "tests/srf/image/files.h"
#include "tests/support/pictures.h"

#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <set>

namespace surflect::film {
namespace {

using scene::Tone;
using testing::colors;

std::array<int, 3> pixelOf(const DisplayPicture& picture, size_t i) {
  const size_t first = i * static_cast<size_t>(picture.channels);
  return {picture.bytes[first], picture.bytes[first + 1], picture.bytes[first + 2]};
}
using Bytes = std::array<int, 3>;

// Premultiplied colours, straight ones 0 to `most`, under random alpha; and pixels of no, half and full
// alpha.
image::Image randomColor(float most) {
  image::Image color = image::randomImage(61, 40, 4, 0, 1, 3);
  for (size_t i = 0; i < color.values.size(); i += 4) {
    const float alpha = i % 7 == 0 ? 0 : i % 5 == 0 ? 1 : color.values[i + 3];
    for (size_t c = 0; c < 3; ++c) color.values[i + c] *= alpha * most;
    color.values[i + 3] = alpha;
  }
  return color;
}

TEST(Display, WhiteIsTheGivenRadianceAndChannelsKeepTheirOrder) {
  const DisplayPicture shown = shownColor(
      colors({{0, 0, 0, 1}, {2, 2, 2, 1}, {2, 0, 0, 1}, {0, 2, 0, 1}, {9, 9, 9, 1}}), {.white = 2});
  EXPECT_EQ(pixelOf(shown, 0), (Bytes{0, 0, 0}));
  EXPECT_EQ(pixelOf(shown, 1), (Bytes{255, 255, 255}));
  EXPECT_EQ(pixelOf(shown, 2), (Bytes{255, 0, 0}));
  EXPECT_EQ(pixelOf(shown, 3), (Bytes{0, 255, 0}));
  EXPECT_EQ(pixelOf(shown, 4), (Bytes{255, 255, 255}));
}

TEST(Display, AStopDoublesRadiance) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0, 1);
  image::Image one(32, 1, 4), two(32, 1, 4);
  for (size_t i = 0; i < one.values.size(); ++i) {
    one.values[i] = i % 4 == 3 ? 1 : unit(random);
    two.values[i] = i % 4 == 3 ? 1 : 2 * one.values[i];
  }
  for (const Tone tone : {Tone::none, Tone::filmic})
    EXPECT_EQ(shownColor(one, {.exposureStops = 1, .white = 3, .tone = tone}).bytes,
              shownColor(two, {.white = 3, .tone = tone}).bytes);
}

TEST(Display, TransparencyShowsTheBackgroundInLinearLight) {
  const Rgb background{1, 0, 0.5f};
  const DisplayPicture shown = shownColor(colors({{0, 0, 0, 0}, {0.5f, 0.5f, 0.5f, 0.5f}, {0, 0, 0, 0.5f}}),
                                          {.background = background});
  EXPECT_EQ(pixelOf(shown, 0), (Bytes{255, 0, 128}));
  EXPECT_EQ(pixelOf(shown, 1), (Bytes{255, 188, 204})); // half of white, half of the background
  EXPECT_EQ(pixelOf(shown, 2)[0], 188);
}

TEST(Display, TheFilmicCurveRisesFromBlackToWhite) {
  EXPECT_EQ(toned(0, Tone::filmic), 0);
  EXPECT_EQ(toned(5.6f, Tone::filmic), 1);
  for (float x = 0; x < 8; x += 0.01f) EXPECT_LT(toned(x, Tone::filmic), toned(x + 0.01f, Tone::filmic));
  for (float x = 8; x < 65504; x *= 1.05f) EXPECT_LE(toned(x, Tone::filmic), toned(1.05f * x, Tone::filmic));
  EXPECT_EQ(toned(1e30f, Tone::filmic), toned(65504, Tone::filmic));
}

TEST(Display, CoverIsColourPlusTheBackgroundsUncoveredPart) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int i = 0; i < 1000; ++i) {
    const float color = unit(random), behind = unit(random), alpha = unit(random);
    EXPECT_EQ(over(color, 1, behind), color);
    EXPECT_EQ(over(0, 0, behind), behind);
    EXPECT_EQ(over(color * 0.5f, 0.5f, behind), 0.5f * color + 0.5f * behind); // halves are exact
    EXPECT_NEAR(over(color * alpha, alpha, color), color, 2e-7f);              // its own colour behind it
  }
}

TEST(Display, APictureOverABackgroundIsTheTransparentOneOverIt) {
  const image::Image color = randomColor(3);
  const Rgb background{0.2f, 0.5f, 0.8f};
  for (const Tone tone : {Tone::none, Tone::filmic}) {
    const DisplayPicture clear = shownColor(color, {.white = 2, .tone = tone, .isTransparent = true}),
                         over = shownColor(color, {.white = 2, .tone = tone, .background = background});
    ASSERT_EQ(clear.channels, 4);
    ASSERT_EQ(over.channels, 3);
    for (size_t i = 0; i < color.values.size() / 4; ++i) {
      const float alpha = color.values[4 * i + 3];
      for (size_t c = 0; c < 3; ++c) {
        const float straight = image::linearFromSrgb(static_cast<float>(clear.bytes[4 * i + c]) / 255),
                    back = image::linearFromSrgb(c == 0   ? background.r
                                                 : c == 1 ? background.g
                                                          : background.b);
        const float wanted = 255 * image::srgbFromLinear(alpha * straight + (1 - alpha) * back);
        EXPECT_NEAR(over.bytes[3 * i + c], wanted, 1.01f) << alpha; // two roundings of half a code
      }
    }
  }
}

TEST(Display, TheToneCurveIsTheObjectsAloneAlsoOverItsShadow) {
  method::FrameLayers film{colors({{2, 2, 2, 0.5f}, {1, 1, 1, 0.25f}, {0, 0, 0, 0}, {0.5f, 0.5f, 0.5f, 1}}),
                           {}};
  const method::FrameLayers bare = film;
  film.shadow = image::Image(4, 1, 1);
  film.shadow.values = {0.5f, 0.75f, 0.5f, 0}; // whole behind the object
  const auto code = [](float light) {
    return static_cast<int>(image::quantized(image::srgbFromLinear(light), 255));
  };
  for (const Tone tone : {Tone::none, Tone::filmic}) {
    const float lit = std::min(1.f, toned(4, tone)), half = toned(0.5f, tone);
    for (const float back : {0.f, 0.5f, 1.f}) {
      const DisplayPicture shown = shownColor(film, {.tone = tone, .background = {back, back, back}});
      EXPECT_EQ(pixelOf(shown, 0)[0], code(0.5f * lit));
      EXPECT_EQ(pixelOf(shown, 1)[0], code(0.25f * lit)) << "however bright it is";
      EXPECT_EQ(pixelOf(shown, 2)[0], code(0.5f * image::linearFromSrgb(back)));
      EXPECT_EQ(pixelOf(shown, 3)[0], code(half));
    }
    const DisplayPicture black = shownColor(bare, {.tone = tone, .background = {0, 0, 0}}),
                         clear = shownColor(film, {.tone = tone, .isTransparent = true});
    EXPECT_EQ(pixelOf(black, 0)[0], code(0.5f * lit)) << "as over a black background";
    EXPECT_EQ(pixelOf(clear, 0)[0], code(0.5f * lit));
    EXPECT_EQ(pixelOf(clear, 1)[0], code(0.25f * lit));
    EXPECT_EQ(pixelOf(clear, 2)[0], 0);
    EXPECT_EQ(clear.bytes[3], 255);
    EXPECT_EQ(clear.bytes[7], 255);
    EXPECT_EQ(clear.bytes[11], 128);
  }
}

TEST(Display, SixteenBitsAreTheSamePictureInFinerCodes) {
  method::FrameLayers film{randomColor(3), {}};
  film.shadow = image::randomImage(61, 40, 1, 0, 1, 4);
  for (size_t i = 0; i < film.shadow.values.size(); ++i)
    film.shadow.values[i] *= 1 - std::min(1.f, film.color.values[4 * i + 3]);
  for (const bool isTransparent : {false, true}) {
    DisplayOptions options{
        .white = 2, .tone = Tone::filmic, .background = {0.2f, 0.5f, 0.8f}, .isTransparent = isTransparent};
    const DisplayPicture coarse = shownColor(film, options);
    options.bits = 16;
    const DisplayPicture fine = shownColor(film, options);
    ASSERT_EQ(fine.bytes.size(), 2 * coarse.bytes.size());
    std::set<int> codes;
    for (size_t i = 0; i < coarse.bytes.size(); ++i) {
      const int code = fine.bytes[2 * i] + 256 * fine.bytes[2 * i + 1];
      EXPECT_NEAR(code / 257.0, coarse.bytes[i], 0.51);
      codes.insert(code);
    }
    EXPECT_GT(codes.size(), 2000u);
  }
}

TEST(Display, ABackgroundKeepsItsColoursUnderAnyTone) {
  DisplayOptions options{.exposureStops = 2, .tone = Tone::filmic};
  for (int code = 0; code < 256; ++code) {
    const float value = static_cast<float>(code) / 255;
    options.background = {value, value, value};
    EXPECT_EQ(pixelOf(shownColor(colors({{0, 0, 0, 0}}), options), 0), (Bytes{code, code, code}));
  }
}

TEST(Display, AnInfinitePixelIsWhiteAndNoNumberIsBlack) {
  constexpr float infinite = std::numeric_limits<float>::infinity();
  const image::Image color = colors(
      {{infinite, -infinite, std::numeric_limits<float>::quiet_NaN(), 1}, {infinite, infinite, 0, 0.6f}});
  for (const Tone tone : {Tone::none, Tone::filmic}) {
    EXPECT_EQ(shownColor(color, {.white = 2, .tone = tone, .isTransparent = true}).bytes,
              (std::vector<uint8_t>{255, 0, 0, 255, 255, 255, 0, 153}));
    EXPECT_EQ(shownColor(color, {.white = 2, .tone = tone}).bytes[0], 255);
  }
}

TEST(Display, APngShowsExposedColoursWithStraightAlpha) {
  const image::TemporaryFolder folder;
  image::Image color = randomColor(3);
  color.at(5, 5)[0] = 0.25f, color.at(5, 5)[3] = 0; // light without alpha stays finite
  writeFileAtomically(folder / "shown.png",
                      std::string_view(pngBytes(shownColor(color, {.white = 2, .isTransparent = true}))));
  const image::PngPicture png = image::readPng(folder / "shown.png");
  ASSERT_EQ(png.image.channels, 4);
  EXPECT_EQ(png.bitDepth, 8);
  constexpr float step = 0.5001f / 255;
  for (size_t i = 0; i < color.values.size(); i += 4) {
    const float alpha = color.values[i + 3];
    EXPECT_NEAR(png.image.values[i + 3], alpha, step);
    if (alpha == 0) continue;
    for (size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(png.image.values[i + c],
                  image::srgbFromLinear(std::min(1.f, color.values[i + c] / alpha / 2)), step);
  }
}

class FinishOf : public ::testing::Test {
protected:
  static scene::Output output(const std::string& lines, const std::string& size = "[6, 4]") {
    return *scene::parseScript("[output]\nsize = " + size + "\npath = \"#.exr\"\n" + lines,
                               folder() / "shot.toml")
                .output;
  }
  static std::string complaint(const std::string& lines) {
    return image::errorOf([&] { Finish(output(lines), "shot.toml"); });
  }
  static const image::TemporaryFolder& folder() {
    static const image::TemporaryFolder one;
    return one;
  }
};

TEST_F(FinishOf, APictureBehindKeepsItsBytes) {
  const image::Image picture = image::randomImage(6, 4, 3, 0, 1, 2);
  image::writePng(folder() / "sky.png", picture, 8, image::PngColors::srgb);
  const Finish finish(output("background = \"sky.png\"\ntone = \"filmic\""), "shot.toml");
  const DisplayPicture shown = shownColor(image::Image(6, 4, 4), finish.optionsFor(6, 4));
  const image::Image read = image::readPng(folder() / "sky.png").image;
  for (size_t i = 0; i < shown.bytes.size(); ++i)
    EXPECT_EQ(shown.bytes[i], std::lround(255 * read.values[i]));
}

TEST_F(FinishOf, APictureOfAnotherSizeIsAveragedInLinearLight) {
  image::Image picture(2, 2, 3); // a white column beside a black one
  for (size_t i = 0; i < 12; ++i) picture.values[i] = i / 3 % 2 == 0 ? 1 : 0;
  image::writePng(folder() / "columns.png", picture, 8, image::PngColors::srgb);
  const Finish finish(output("background = \"columns.png\"", "[1, 1]"), "shot.toml");
  EXPECT_EQ(pixelOf(shownColor(image::Image(1, 1, 4), finish.optionsFor(1, 1)), 0), (Bytes{188, 188, 188}));
}

TEST_F(FinishOf, OtherPicturesHaveOtherIdentities) {
  image::writePng(folder() / "a.png", image::randomImage(6, 4, 3, 0, 1, 2), 8);
  image::writePng(folder() / "b.png", image::randomImage(6, 4, 3, 0, 1, 3), 8);
  const auto identity = [](const std::string& lines) {
    return Finish(output(lines), "shot.toml").identity();
  };
  EXPECT_NE(identity("background = \"a.png\""), identity("background = \"b.png\""));
  EXPECT_EQ(identity("background = [0, 0, 1]"), "");
}

TEST_F(FinishOf, WhatCannotBeBehindIsToldWithItsPlace) {
  image::writePng(folder() / "tall.png", image::Image(4, 6, 3), 8);
  EXPECT_EQ(complaint("background = \"tall.png\""),
            "shot.toml: output.background: " + (folder() / "tall.png").string() +
                ": found 4 x 6, expected a picture of the frames' shape, 6 x 4");
  EXPECT_NE(complaint("background = \"none.png\"").find("cannot open"), std::string::npos);
}

// A configuration whose film view is 0.5 x^(1/2) per channel, from scene-linear light.
constexpr const char* kConfiguration = R"(ocio_profile_version: 1
search_path: ""
strictparsing: true
luma: [0.2126, 0.7152, 0.0722]
roles:
  scene_linear: lin
  default: lin
displays:
  screen:
    - !<View> {name: film, colorspace: film}
    - !<View> {name: plain, colorspace: lin}
    - !<View> {name: lifted, colorspace: lifted}
active_displays: [screen]
active_views: [film, plain, lifted]
colorspaces:
  - !<ColorSpace>
    name: lin
    bitdepth: 32f
    isdata: false
  - !<ColorSpace>
    name: lifted
    bitdepth: 32f
    isdata: false
    from_reference: !<MatrixTransform> {matrix: [0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1], offset: [0.25, 0.25, 0.25, 0]}
  - !<ColorSpace>
    name: film
    bitdepth: 32f
    isdata: false
    from_reference: !<GroupTransform>
      children:
        - !<ExponentTransform> {value: [0.5, 0.5, 0.5, 1]}
        - !<MatrixTransform> {matrix: [0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.5, 0, 0, 0, 0, 1]}
)";

TEST_F(FinishOf, OcioShowsWhatItsConfigurationSays) {
  writeFileAtomically(folder() / "config.ocio", std::string_view(kConfiguration));
  ::setenv("OCIO", (folder() / "config.ocio").c_str(), 1);
  const Finish film(output("tone = \"ocio\""), "shot.toml"),
      plain(output("tone = \"ocio\"\nocio_display = \"screen\"\nocio_view = \"plain\""), "shot.toml"),
      lifted(output("tone = \"ocio\"\nocio_view = \"lifted\""), "shot.toml");
  EXPECT_NE(film.identity(), plain.identity());
  image::Image color = randomColor(4);
  DisplayOptions options = film.optionsFor(61, 40);
  options.isTransparent = true;
  const DisplayPicture shown = shownColor(color, options);
  for (size_t i = 0; i < color.values.size(); i += 4) {
    if (color.values[i + 3] == 0) continue;
    for (size_t c = 0; c < 3; ++c)
      EXPECT_NEAR(shown.bytes[i + c],
                  255 * std::min(1.f, 0.5f * std::sqrt(color.values[i + c] / color.values[i + 3])), 0.51f);
  }
  method::FrameLayers shadow{colors({{0, 0, 0, 0}, {0, 0, 0, 0}}), {}};
  shadow.shadow = image::Image(2, 1, 1);
  shadow.shadow.values = {0.5f, 1};
  options = lifted.optionsFor(2, 1); // shows black as 0.25
  options.background = {1, 1, 1}, options.isTransparent = false;
  const DisplayPicture dark = shownColor(shadow, options);
  EXPECT_EQ(pixelOf(dark, 0), (Bytes{188, 188, 188})) << "half of white";
  EXPECT_EQ(pixelOf(dark, 1), (Bytes{0, 0, 0}));
  const DisplayOptions linear = plain.optionsFor(1, 1);
  EXPECT_EQ(pixelOf(shownColor(colors({{0.5f, 0.25f, 2, 1}}), linear), 0), (Bytes{128, 64, 255}));
  EXPECT_EQ(complaint("tone = \"ocio\"\nocio_view = \"plan\""),
            "shot.toml: output.ocio_view: found \"plan\", expected one of the views of screen: film, plain, "
            "lifted; did "
            "you mean plain?");
  EXPECT_EQ(
      complaint("tone = \"ocio\"\nocio_display = \"scren\""),
      "shot.toml: output.ocio_display: found \"scren\", expected one of the displays of $OCIO: screen; did "
      "you mean screen?");
  ::setenv("OCIO", (folder() / "shot.toml").c_str(), 1);
  EXPECT_NE(complaint("tone = \"ocio\"").find("shot.toml: output.tone: $OCIO, "), std::string::npos);
  ::unsetenv("OCIO");
  EXPECT_EQ(
      complaint("tone = \"ocio\""),
      "shot.toml: output.tone: \"ocio\" needs a configuration of OpenColorIO, which the environment variable "
      "OCIO names; it is not set");
}

} // namespace
} // namespace surflect::film
