#include "bench/gallery/figures.h"

#include "render/film/frame_file.h"
#include "render/method/renderer.h"
#include "srf/image/color.h"
#include "srf/image/exr.h"
#include "srf/image/png.h"
#include "srf/weights/environment_map.h"
#include "tests/support/synthetic_capture.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <limits>
#include <numbers>
#include <random>
#include <sstream>

namespace surflect::bench {
namespace {

using Json = nlohmann::json;

// RGB picture whose values survive 8-bit rounding.
image::Image randomPicture(int width, int height, std::mt19937& random) {
  image::Image image(width, height, 3);
  for (float& value : image.values) value = static_cast<float>(random() % 256) / 255;
  return image;
}

image::Image composed(const image::TemporaryFolder& folder, Json layout) {
  layout["out"] = folder / "out.png";
  std::istringstream text(layout.dump());
  composePanels(text);
  return image::readPng(folder / "out.png").image;
}

std::array<float, 3> colorAt(const image::Image& image, int x, int y) {
  return {image.at(x, y)[0], image.at(x, y)[1], image.at(x, y)[2]};
}

TEST(Panels, PicturesStandUnchangedBesideAndBelowEachOther) {
  const image::TemporaryFolder folder;
  std::mt19937 random(1);
  const std::array pictures{randomPicture(5, 4, random), randomPicture(3, 7, random),
                            randomPicture(6, 2, random)};
  Json cells = Json::array();
  for (size_t i = 0; i < pictures.size(); ++i) {
    const auto file = folder / std::to_string(i).append(".png");
    image::writePng(file, pictures[i]);
    cells.push_back({{"file", file}});
  }
  const image::Image sheet = composed(folder, {{"columns", 2}, {"cells", cells}});
  ASSERT_EQ(sheet.width, 6 + 6 + 3); // width of a column's widest cell, and the gap
  ASSERT_EQ(sheet.height, 7 + 6 + 2);
  image::Image wanted(sheet.width, sheet.height, 3);
  std::ranges::fill(wanted.values, 1.f);
  const std::array<std::array<int, 2>, 3> corners{{{0, 0}, {12, 0}, {0, 13}}};
  for (size_t i = 0; i < pictures.size(); ++i)
    for (int y = 0; y < pictures[i].height; ++y)
      for (int x = 0; x < pictures[i].width; ++x)
        std::ranges::copy(colorAt(pictures[i], x, y),
                          wanted.at(corners[i][0] + x, corners[i][1] + y).begin());
  EXPECT_EQ(sheet.values, wanted.values);
}

TEST(Panels, ZoomRepeatsThePixelsOfTheCrop) {
  const image::TemporaryFolder folder;
  std::mt19937 random(2);
  const image::Image picture = randomPicture(9, 8, random);
  image::writePng(folder / "p.png", picture);
  const auto cropped = [&](const Json& crop) {
    return composed(folder,
                    {{"columns", 1}, {"cells", {{{"file", folder / "p.png"}, {"crop", crop}, {"zoom", 3}}}}});
  };
  const image::Image sheet = cropped({2, 1, 5, 4});
  ASSERT_EQ(sheet.width, 15);
  ASSERT_EQ(sheet.height, 12);
  for (int y = 0; y < 12; ++y)
    for (int x = 0; x < 15; ++x) EXPECT_EQ(colorAt(sheet, x, y), colorAt(picture, 2 + x / 3, 1 + y / 3));
  EXPECT_THROW(cropped({5, 1, 5, 4}), Error);
}

// A film of uniform radiance: opaque at depth 1 in its left half, empty in its right half.
std::filesystem::path filmOf(const image::TemporaryFolder& folder, const std::string& name, float radiance) {
  method::FrameLayers film{image::Image(20, 10, 4), {{"depth", image::Image(20, 10, 1)}}};
  for (size_t i = 0; i < 200; ++i) {
    const bool isObject = i % 20 < 10;
    if (isObject) std::ranges::copy(std::array{radiance, radiance, radiance, 1.f}, &film.color.values[4 * i]);
    film.aovs["depth"].values[i] = isObject ? 1 : std::numeric_limits<float>::infinity();
  }
  film::writeFrame(folder / name, film, {});
  return folder / name;
}

TEST(Panels, FilmsOfOneNameShareAnExposure) {
  const image::TemporaryFolder folder;
  const auto bright = filmOf(folder, "bright.exr", 2), dim = filmOf(folder, "dim.exr", 0.5f);
  const auto ofDim = [&](const char* white) {
    const Json cells{{{"file", bright}, {"white", "a"}}, {{"file", dim}, {"white", white}}};
    return composed(folder, {{"columns", 2}, {"cells", cells}}).at(26 + 5, 5)[0];
  };
  EXPECT_NEAR(ofDim("a"), image::srgbFromLinear(0.25f), 0.5 / 255);
  EXPECT_EQ(ofDim("b"), 1);
}

TEST(Panels, ALampShowsBeforeTheObjectAndIsHiddenBehindIt) {
  const image::TemporaryFolder folder;
  const auto film = filmOf(folder, "film.exr", 1);
  const auto with = [&](double depth) {
    const Json dot{10, 5, 4, 0, 0, 1, depth}; // blue, in the centre
    return composed(folder, {{"columns", 1}, {"cells", {{{"file", film}, {"dots", {dot}}}}}});
  };
  const image::Image before = with(0.5), behind = with(2);
  const std::array white{1.f, 1.f, 1.f};
  for (const int x : {7, 12}) EXPECT_LT(before.at(x, 5)[0], 0.5f);
  EXPECT_EQ(colorAt(behind, 7, 5), white);
  EXPECT_EQ(colorAt(behind, 12, 5), colorAt(before, 12, 5));
  for (const int x : {5, 14}) EXPECT_EQ(colorAt(before, x, 5), white); // outside the dot's radius
}

// A sphere seen by one camera, and its reflectance image under an environment.
class ReflectanceImage : public ::testing::Test {
protected:
  static constexpr size_t kLights = 200;

  ReflectanceImage() {
    studio_.cameras = 1;
    studio_.lights = kLights;
    studio_.size = 30;
    capture_ = photograph(studio_, folder_ / "capture");
    view_ = studio::viewSphere(capture_.views[0].camera, studio_.samples);
  }

  image::Image sum(const image::Image& environment) {
    image::writeExr(folder_ / "environment.exr", environment, image::Precision::single);
    relightReflectanceImage(folder_ / "capture", "C0", folder_ / "environment.exr", folder_ / "figure");
    return image::ExrFile(folder_ / "figure/sum.exr").read({"R", "G", "B", "A"});
  }

  image::TemporaryFolder folder_;
  studio::Studio studio_;
  capture::Capture capture_;
  studio::SphereView view_;
};

TEST_F(ReflectanceImage, EachTexelShinesFromTheLightNearestToIt) {
  std::mt19937 random(3);
  image::Image environment(128, 64, 3);
  for (int k = 0; k < 4; ++k) {
    const auto texel = environment.at(static_cast<int>(random() % 128), static_cast<int>(random() % 64));
    for (float& value : texel) value = static_cast<float>(16 * (1 + random() % 1000));
  }
  // Lat-long directions as docs define them, with z of the world up and y in the middle.
  image::Image wanted(studio_.size, studio_.size, 4);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 128; ++x) {
      const auto texel = environment.at(x, y);
      if (texel[0] == 0) continue;
      const double latitude = std::numbers::pi * (0.5 - (y + 0.5) / 64),
                   longitude = 2 * std::numbers::pi * ((x + 0.5) / 128 - 0.5);
      const Vec3<double> direction(std::sin(longitude) * std::cos(latitude),
                                   std::cos(longitude) * std::cos(latitude), std::sin(latitude));
      const auto towards = std::ranges::max(studio::spiral(kLights), {},
                                            [&](const Vec3<double>& light) { return light.dot(direction); });
      const double solidAngle =
          2 * std::numbers::pi / 128 *
          (std::sin(latitude + std::numbers::pi / 128) - std::sin(latitude - std::numbers::pi / 128));
      const Rgb irradiance = static_cast<float>(solidAngle) * Rgb{texel[0], texel[1], texel[2]};
      const image::Image lit = studio::overBlack(view_, [&](const Vec3<float>& n) {
        return studio::lambert(studio_.albedo, irradiance, n, towards.cast<float>());
      });
      for (size_t i = 0; i < lit.values.size(); ++i) wanted.values[i] += lit.values[i];
    }
  for (size_t i = 0; i < view_.alpha.values.size(); ++i) wanted.values[4 * i + 3] = view_.alpha.values[i];
  const image::Image got = sum(environment);
  const float brightest = std::ranges::max(wanted.values);
  ASSERT_GT(brightest, 2); // a colour rather than alpha
  for (size_t i = 0; i < wanted.values.size(); ++i)
    ASSERT_NEAR(got.values[i], wanted.values[i], 2e-3 * brightest) << i; // rounded to half floats twice
}

TEST_F(ReflectanceImage, InLightFromEverywhereTheSphereHasTheColourOfItsAlbedo) {
  image::Image environment(128, 64, 3);
  std::ranges::fill(environment.values, 1.f);
  const image::Image got = sum(environment);
  size_t inside = 0;
  for (size_t i = 0; i < view_.alpha.values.size(); ++i) {
    if (view_.alpha.values[i] < 1) continue;
    ++inside;
    const Rgb& albedo = studio_.albedo;
    for (const auto& [value, wanted] : {std::pair(got.values[4 * i], albedo.r),
                                        {got.values[4 * i + 1], albedo.g},
                                        {got.values[4 * i + 2], albedo.b}})
      EXPECT_NEAR(value / wanted, 1, 0.02); // error with 200 lights
  }
  EXPECT_GT(inside, 100u);
}

TEST_F(ReflectanceImage, ACameraThatIsNotThereIsNamed) {
  const std::string error = image::errorOf(
      [&] { relightReflectanceImage(folder_ / "capture", "C7", folder_ / "none.exr", folder_ / "figure"); });
  EXPECT_NE(error.find("C7"), std::string::npos) << error;
}

TEST(Splats, EllipsesCloseTheStretchedGridAndReducedOnesDoNot) {
  const image::TemporaryFolder folder;
  drawSplats(folder.path());
  const auto share = [&](const char* name) { // fraction of covered pixels
    const image::Image alpha = image::ExrFile(folder / name).read({"A"});
    return static_cast<double>(std::ranges::count(alpha.values, 1.f)) /
           static_cast<double>(alpha.values.size());
  };
  EXPECT_EQ(share("elliptical.exr"), 1);
  EXPECT_LT(share("elliptical-reduced.exr"), 0.9);
  EXPECT_LT(share("circular-reduced.exr"), share("elliptical-reduced.exr"));
}

TEST(BesideTruth, APhotographStandsBesideWhatARenderingIsOffIt) {
  const image::TemporaryFolder folder;
  studio::Studio studio;
  studio.cameras = 2, studio.lights = 3, studio.size = 20;
  const capture::Capture capture = photograph(studio, folder / "capture");
  const auto beside = [&](const std::string& camera, const std::string& light, const image::Image& rendered) {
    film::writeFrame(folder / "rendered.exr", {rendered, {}}, {});
    writeTruthAndDifference(folder / "capture", camera, light, folder / "rendered.exr", folder / "out");
    return std::pair(image::ExrFile(folder / "out/truth.exr").read({"R", "G", "B", "A"}),
                     image::ExrFile(folder / "out/difference.exr").read({"R", "G", "B", "A"}));
  };
  std::mt19937 random(4);
  image::Image rendered(20, 20, 4);
  for (float& value : rendered.values) value = static_cast<float>(random() % 256) / 256;
  for (size_t view = 0; view < 2; ++view)
    for (const capture::Light& light : capture.lights) {
      const auto [truth, difference] = beside(capture.views[view].identity, light.name, rendered);
      const auto sphere = studio::viewSphere(capture.views[view].camera, studio.samples);
      const image::Image lit = studio::overBlack(sphere, [&](const Vec3<float>& n) {
        return studio::lambert(studio.albedo, capture::irradianceAt(light, {0, 0, 0}), n,
                               capture::towardsLight(light, {0, 0, 0}).raw().cast<float>());
      });
      for (size_t i = 0; i < lit.values.size(); ++i) {
        const bool isAlpha = i % 4 == 3;
        const float wanted = isAlpha ? sphere.alpha.values[i / 4] : lit.values[i];
        ASSERT_NEAR(truth.values[i], wanted, 6e-4); // half-float rounding
        ASSERT_NEAR(difference.values[i],
                    isAlpha ? std::max(wanted, rendered.values[i]) : std::abs(wanted - rendered.values[i]),
                    6e-4);
      }
    }
  EXPECT_THROW(beside("C1", "dusk", rendered), Error);
  EXPECT_THROW(beside("C2", capture.lights[0].name, rendered), Error);
  EXPECT_THROW(beside("C1", capture.lights[0].name, image::Image(19, 20, 4)), Error);
}

} // namespace
} // namespace surflect::bench
