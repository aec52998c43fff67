#include "srf/calibration/response.h"

#include "srf/capture/photograph.h"
#include "srf/image/color.h"
#include "srf/image/png.h"
#include "tests/srf/image/files.h"

#include <cmath>

namespace surflect::calibration {
namespace {

// Values of three cameras for exposure x, 0..1.
float film(float x) { return 1 - std::exp(-2.2f * std::pow(x, 0.8f)); }
float power(float x) { return std::pow(std::min(x, 1.f), 0.45f); }
float srgb(float x) { return std::min(1.f, image::srgbFromLinear(x)); }
constexpr std::array curves{film, power, srgb};

// The exposure at the middle of a code, in the scale of a recovered response.
double exposureOf(size_t channel, size_t z, double middle) {
  double low = 0, high = 1e3;
  for (int i = 0; i < 100; ++i) {
    const double x = (low + high) / 2;
    (static_cast<double>(curves[channel](static_cast<float>(x))) * 255 < static_cast<double>(z) ? low
                                                                                                : high) = x;
  }
  return low / middle * static_cast<double>(image::linearFromSrgb(128 / 255.f));
}

// A capture of one bracket: a scene of three decades, seen through the three curves as red, green, blue.
struct BracketCapture {
  image::TemporaryFolder folder;
  capture::Capture capture;
  image::Image scene;

  explicit BracketCapture(double noise, unsigned seed = 1) {
    constexpr int width = 120, height = 80;
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> logarithm(-6, 1.9f);
    std::normal_distribution<double> normal;
    scene = image::Image(width, height, 3);
    for (size_t i = 0; i < scene.values.size(); i += 3) {
      const float radiance = std::exp(logarithm(random));
      std::fill_n(scene.values.begin() + static_cast<std::ptrdiff_t>(i), 3, radiance);
    }
    capture.file = folder / "transforms.json";
    capture.views = {{"C", {{capture::Lens::Model::pinhole, width, height, 10, 10, 60, 40}, {}}}};
    for (int k = -3; k <= 5; ++k) {
      capture::Exposure shot{"shot" + std::to_string(k) + ".png", "", "", std::exp2(k)};
      image::Image picture = scene;
      for (size_t i = 0; i < picture.values.size(); ++i) {
        const float x = scene.values[i] * static_cast<float>(shot.exposure);
        picture.values[i] = curves[i % 3](x) + static_cast<float>(noise * normal(random));
      }
      image::writePng(folder / shot.picture, picture);
      if (k == -3)
        capture.frames.push_back({.picture = shot.picture, .exposure = shot.exposure});
      else
        capture.frames[0].further.push_back(shot);
    }
  }
};

TEST(RecoverResponse, GivesBackTheCurveOfTheCamera) {
  for (const double noise : {0., 0.004}) {
    const BracketCapture bracket(noise);
    const image::Response response = recoverResponse(bracket.capture, {});
    for (size_t c = 0; c < 3; ++c) {
      const double middle = exposureOf(c, 128, static_cast<double>(image::linearFromSrgb(128 / 255.f)));
      for (size_t z = noise > 0 ? 16 : 8; z <= 247; ++z) {
        const double expected = exposureOf(c, z, middle);
        EXPECT_NEAR(response.exposure[c][z], expected, (noise > 0 ? 0.03 : 0.015) * expected)
            << c << " " << z;
      }
    }
  }
}

TEST(RecoverResponse, NeverFalls) {
  const BracketCapture bracket(0.03);
  const image::Response response = recoverResponse(bracket.capture, {});
  for (const auto& curve : response.exposure) {
    EXPECT_GE(curve[0], 0);
    for (size_t z = 1; z < curve.size(); ++z) EXPECT_GE(curve[z], curve[z - 1]);
  }
}

TEST(RecoverResponse, MergedPhotographsAreProportionalToTheScene) {
  BracketCapture bracket(0.002);
  bracket.capture.response = recoverResponse(bracket.capture, {});
  const size_t frame = 0;
  const capture::Photograph photograph = capture::readPhotographs(bracket.capture, std::span(&frame, 1))[0];
  for (size_t c = 0; c < 3; ++c) {
    double sum = 0, squares = 0;
    size_t count = 0;
    for (size_t i = c; i < bracket.scene.values.size(); i += 3) {
      const double d = std::log(static_cast<double>(photograph.radiance.values[i] / bracket.scene.values[i]));
      sum += d;
      squares += d * d;
      ++count;
    }
    const double n = static_cast<double>(count), mean = sum / n;
    EXPECT_LT(std::sqrt(squares / n - mean * mean), 0.02) << c;
  }
}

TEST(RecoverLogResponse, DoesNotDependOnTheUnitOfTimeNorTheNumberOfPixels) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform;
  std::vector<double> logSeconds, logMinutes;
  for (int k = 0; k < 6; ++k) {
    logSeconds.push_back(k * std::log(2));
    logMinutes.push_back(logSeconds.back() - std::log(60));
  }
  std::vector<BracketPixel> seconds, minutes;
  for (int i = 0; i < 400; ++i) {
    const double radiance = std::exp(5 * uniform(random) - 6);
    BracketPixel pixel{logSeconds, {}};
    for (const double t : logSeconds)
      pixel.codes.push_back(static_cast<uint8_t>(std::min(255., 255 * std::sqrt(radiance * std::exp(t)))));
    seconds.push_back(pixel);
    pixel.logSeconds = logMinutes;
    minutes.insert(minutes.end(), 2, pixel);
  }
  const auto a = recoverLogResponse(seconds, 4), b = recoverLogResponse(minutes, 4);
  EXPECT_EQ(a[128], 0);
  for (size_t z = 0; z < a.size(); ++z) EXPECT_NEAR(a[z], b[z], 1e-8);
}

TEST(RecoverResponse, WhatTellsNothingIsRefused) {
  BracketCapture bracket(0);
  capture::Capture single = bracket.capture;
  single.frames[0].further.clear();
  EXPECT_NE(image::errorOf([&] {
              recoverResponse(single, {});
            }).find("frames: found none, expected frames that differ in exposure alone"),
            std::string::npos);
  image::writePng(bracket.folder / "shot0.png", bracket.scene, 16);
  EXPECT_NE(image::errorOf([&] { recoverResponse(bracket.capture, {}); }).find("shot0.png: found 16 bits"),
            std::string::npos);
  image::writePng(bracket.folder / "shot0.png", image::Image(3, 3, 3));
  EXPECT_NE(image::errorOf([&] {
              recoverResponse(bracket.capture, {});
            }).find("shot0.png: size: found 3 x 3, expected 120 x 80"),
            std::string::npos);
  const capture::Exposure shots[] = {{"black.png", "", "", 1}, {"white.png", "", "", 2}};
  image::writePng(bracket.folder / "black.png", image::Image(120, 80, 3));
  image::Image white(120, 80, 3);
  std::ranges::fill(white.values, 1.f);
  image::writePng(bracket.folder / "white.png", white);
  bracket.capture.frames[0].picture = shots[0].picture;
  bracket.capture.frames[0].further = {shots[1]};
  EXPECT_NE(image::errorOf([&] { recoverResponse(bracket.capture, {}); }).find("between black and clipped"),
            std::string::npos);
}

} // namespace
} // namespace surflect::calibration
