#include "srf/weights/environment_map.h"

#include "srf/image/exr.h"
#include "srf/image/png.h"
#include "tests/srf/image/files.h"
#include "tests/support/random.h"

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

namespace surflect::weights {
namespace {

using EnvironmentDirection = Direction3<EnvironmentSpace, double>;
constexpr double kPi = std::numbers::pi;
constexpr auto allMappings = {EnvironmentMapping::latLong, EnvironmentMapping::angular,
                              EnvironmentMapping::mirrorBall};

std::optional<EnvironmentDirection> directionIn(EnvironmentMapping mapping, double u, double v) {
  if (mapping == EnvironmentMapping::latLong) return latLongDirection(u, v);
  return mapping == EnvironmentMapping::angular ? angularDirection(u, v) : mirrorBallDirection(u, v);
}

void expectNear(const EnvironmentDirection& a, const EnvironmentDirection& b, double tolerance = 2e-15) {
  EXPECT_LT(length(a + -b), tolerance);
}

// Image of a function of direction; the corners of a disk are red.
image::Image pictureOf(EnvironmentMapping mapping, int height,
                       const std::function<double(Vec3<double>)>& radiance) {
  const int width = mapping == EnvironmentMapping::latLong ? 2 * height : height;
  image::Image image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double u = (x + 0.5) / width, v = (y + 0.5) / height;
      const auto towards = directionIn(mapping, u, v);
      const auto value = towards ? static_cast<float>(radiance(towards->raw())) : 0;
      std::ranges::fill(image.at(x, y), value);
      if (!towards) image.at(x, y)[0] = 1000;
    }
  return image;
}

// Integral of f(direction) dE over the lights.
double integral(std::span<const EnvironmentLight> lights, const std::function<double(Vec3<double>)>& f) {
  double sum = 0;
  for (const auto& light : lights) sum += f(light.towards.raw().cast<double>()) * light.irradiance.g;
  return sum;
}

double constantOne(const Vec3<double>&) { return 1; }

// A smooth function with a lobe 100 times as bright as the rest.
double lively(const Vec3<double>& d) {
  const Vec3<double> sun = Vec3<double>(0.3, 0.8, -0.5).normalized();
  return 1 + 0.5 * d[0] + 100 * std::exp(60 * (d.dot(sun) - 1));
}

TEST(Environment, TheMiddleOfALatLongLooksAlongMinusZWithXToTheRight) {
  expectNear(latLongDirection(0.5, 0.5), {0, 0, -1});
  expectNear(latLongDirection(0.75, 0.5), {1, 0, 0});
  expectNear(latLongDirection(0.25, 0.5), {-1, 0, 0});
  expectNear(latLongDirection(0, 0.5), {0, 0, 1});
  expectNear(latLongDirection(0.3, 0), {0, 1, 0});
  expectNear(latLongDirection(0.5, 0.75), {0, -std::sqrt(0.5), -std::sqrt(0.5)});
}

TEST(Environment, TheMiddleOfAnAngularMapLooksAlongMinusZAndItsRimAlongZ) {
  expectNear(*angularDirection(0.5, 0.5), {0, 0, -1});
  expectNear(*angularDirection(0.75, 0.5), {1, 0, 0});
  expectNear(*angularDirection(0.5, 0.25), {0, 1, 0});
  for (const double a : {0.3, 1.7, 4.0})
    expectNear(
        *angularDirection(0.5 + 0.4999999999999999 * std::cos(a), 0.5 + 0.4999999999999999 * std::sin(a)),
        {0, 0, 1});
  EXPECT_FALSE(angularDirection(0.01, 0.01));
  EXPECT_FALSE(angularDirection(0.99, 0.9));
}

TEST(Environment, TheMiddleOfAMirrorBallShowsItsCameraAndTheRestWhatTheNormalReflects) {
  expectNear(*mirrorBallDirection(0.5, 0.5), {0, 0, 1});
  expectNear(*mirrorBallDirection(0.5 + std::sqrt(0.125), 0.5), {1, 0, 0});
  EXPECT_FALSE(mirrorBallDirection(0.01, 0.01));
  std::mt19937 random(5);
  for (int i = 0; i < 300; ++i) {
    Vec3<double> n = randomUnit(random);
    n[2] = std::abs(n[2]) + 0.1; // at the rim, a place determines the normal to rounding over n[2] alone
    n.normalize();
    const Vec3<double> view(0, 0, -1);
    expectNear(*mirrorBallDirection((1 + n[0]) / 2, (1 - n[1]) / 2),
               assume<EnvironmentDirection>(view - 2 * view.dot(n) * n), 1e-14);
  }
}

TEST(Environment, MappingsGiveUnitDirectionsThatTurnAsOneFrame) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> place(0, 1);
  for (int i = 0; i < 300; ++i) {
    const double u = place(random), v = place(random);
    EXPECT_NEAR(length(latLongDirection(u, v)), 1, 1e-15);
    for (const auto& d : {angularDirection(u, v), mirrorBallDirection(u, v)}) {
      if (!d) continue;
      EXPECT_NEAR(length(*d), 1, 1e-15);
      // All mappings agree on right and up.
      EXPECT_EQ(u > 0.5, d->x() > 0);
      EXPECT_EQ(v<0.5, d->y()> 0);
    }
  }
}

TEST(Environment, SolidAnglesSumToTheWholeSphere) {
  for (const auto mapping : allMappings)
    for (const int height : {1, 2, 7, 64}) {
      const auto map = environmentOf(pictureOf(mapping, height, constantOne), mapping);
      EXPECT_NEAR(totalIrradiance(map.lights).g, 4 * kPi, 4e-6) << height;
    }
}

// For every a, the integral of (d . a)^2 is 4 pi / 3 and that of d . a is 0. Texels at the rim of a mirror
// ball have as large a solid angle as others, and are inside or not.
TEST(Environment, SolidAnglesIntegratePolynomials) {
  std::mt19937 random(2);
  for (const auto mapping : allMappings)
    for (int i = 0; i < 5; ++i) {
      const Vec3<double> a = randomUnit(random);
      double error = 0;
      for (const int height : {32, 128}) { // convergence of second order; of a ball, of first order
        const auto map = environmentOf(pictureOf(mapping, height, constantOne), mapping);
        const double squared =
            integral(map.lights, [&](const Vec3<double>& d) { return std::pow(d.dot(a), 2); });
        error = std::abs(squared - 4 * kPi / 3);
        const double bound =
            mapping == EnvironmentMapping::mirrorBall ? 5. / height : 10. / (height * height);
        EXPECT_LT(error, bound) << height;
        EXPECT_NEAR(integral(map.lights, [&](const Vec3<double>& d) { return d.dot(a); }), 0, bound);
      }
    }
}

TEST(Environment, AllMappingsOfOneWorldShineAlike) {
  const auto latLong =
      environmentOf(pictureOf(EnvironmentMapping::latLong, 128, lively), EnvironmentMapping::latLong);
  const auto angular =
      environmentOf(pictureOf(EnvironmentMapping::angular, 256, lively), EnvironmentMapping::angular);
  const auto ball =
      environmentOf(pictureOf(EnvironmentMapping::mirrorBall, 256, lively), EnvironmentMapping::mirrorBall);
  std::mt19937 random(3);
  for (int i = 0; i < 10; ++i) {
    const Vec3<double> n = randomUnit(random);
    const auto cosine = [&](const Vec3<double>& d) { return std::max(0.0, d.dot(n)); };
    EXPECT_NEAR(integral(latLong.lights, cosine) / integral(angular.lights, cosine), 1, 0.003);
    EXPECT_NEAR(integral(latLong.lights, cosine) / integral(ball.lights, cosine), 1, 0.003);
  }
}

TEST(Environment, BadSamplesAreReplacedAndTheirTexelsCounted) {
  const float nan = std::numeric_limits<float>::quiet_NaN(),
              infinity = std::numeric_limits<float>::infinity();
  image::Image image(128, 64, 3);
  std::ranges::fill(image.values, 1.f);
  const auto whole = environmentOf(image, EnvironmentMapping::latLong);
  EXPECT_EQ(whole.replaced, 0u);
  EXPECT_EQ(whole.clamped, 0u);
  std::ranges::copy(std::array{-1.f, 2.f, nan}, image.at(10, 0).begin());
  std::ranges::copy(std::array{nan, -infinity, nan}, image.at(29, 0).begin());
  std::ranges::copy(std::array{infinity, 1.f, -1.f}, image.at(30, 0).begin());
  const auto map = environmentOf(image, EnvironmentMapping::latLong);
  EXPECT_EQ(map.replaced, 3u);
  EXPECT_EQ(map.clamped, 1u);
  ASSERT_EQ(map.lights.size(), whole.lights.size() - 1); // one is black
  for (size_t i = 0; i < map.lights.size(); ++i) {
    Rgb expected = whole.lights[i < 29 ? i : i + 1].irradiance;
    if (i == 10) expected = {0, 2 * expected.g, 0};
    if (i == 29) {
      EXPECT_FLOAT_EQ(map.lights[i].irradiance.r, 65504 * expected.r); // largest half float
      expected = {map.lights[i].irradiance.r, expected.g, 0};
    }
    EXPECT_EQ(map.lights[i].irradiance, expected) << i;
  }
}

// The irradiance of a surface under a white sphere is pi, and under its upper half (1 + cos) pi / 2 for a
// normal that is turned away from the top.
TEST(Environment, AFewTexelsShineAsAreas) {
  std::mt19937 random(7);
  image::Image white(2, 1, 1), top(4, 2, 1);
  std::ranges::fill(white.values, 1.f);
  for (int x = 0; x < 4; ++x) top.at(x, 0)[0] = 1;
  top.at(1, 1)[0] = std::numeric_limits<float>::quiet_NaN();
  const auto whole = environmentOf(white, EnvironmentMapping::latLong);
  const auto half = environmentOf(top, EnvironmentMapping::latLong);
  EXPECT_EQ(half.replaced, 1u); // of many parts
  for (int trial = 0; trial < 20; ++trial) {
    const Vec3<double> n = randomUnit(random);
    const auto cosine = [&](const Vec3<double>& d) { return std::max(0.0, d.dot(n)); };
    EXPECT_NEAR(integral(whole.lights, cosine) / kPi, 1, 1e-3);
    EXPECT_NEAR(integral(half.lights, cosine) / kPi, (1 + n.y()) / 2, 1e-3);
  }
}

TEST(Environment, GrayShinesInAllChannels) {
  image::Image gray(4, 2, 1);
  std::ranges::fill(gray.values, 3.f);
  const Rgb total = totalIrradiance(environmentOf(gray, EnvironmentMapping::latLong).lights);
  EXPECT_NEAR(total.r, 12 * kPi, 1e-5);
  EXPECT_EQ(total.r, total.b);
}

std::vector<EnvironmentLight> lightsOf(std::initializer_list<float> strengths) {
  std::vector<EnvironmentLight> lights;
  for (const float strength : strengths) lights.push_back({{0, 1, 0}, {strength, 0, 0}});
  return lights;
}

TEST(KeyLights, AreAtLeastTwiceTheMeanAndKeepTheirOrder) {
  std::vector<EnvironmentLight> lights(40, {{0, 1, 0}, {1, 1, 1}});
  lights[7].irradiance = {9, 0, 0};
  lights[30].irradiance = {0, 0, 8};
  lights[31].irradiance = {3, 1, 1}; // the mean is 3.2
  const std::vector<EnvironmentLight> before = lights;
  ASSERT_EQ(moveKeyLightsFirst(lights), 2u);
  EXPECT_EQ(lights[0], before[7]);
  EXPECT_EQ(lights[1], before[30]);
  EXPECT_TRUE(std::ranges::is_permutation(lights, before));
}

TEST(KeyLights, AreAllOfAFew) {
  std::vector<EnvironmentLight> one = lightsOf({3}), equal(16, {{0, 1, 0}, {1, 1, 1}}), more = equal, none;
  more.push_back(equal[0]);
  EXPECT_EQ(moveKeyLightsFirst(one), 1u);
  EXPECT_EQ(moveKeyLightsFirst(equal), 16u);
  EXPECT_EQ(moveKeyLightsFirst(more), 0u);
  EXPECT_EQ(moveKeyLightsFirst(none), 0u);
}

TEST(KeyLights, AConstantMapHasNone) {
  const auto texels =
      environmentOf(pictureOf(EnvironmentMapping::latLong, 64, constantOne), EnvironmentMapping::latLong)
          .lights;
  for (const double spread : {1.0, 0.5, 0.3, 0.18, 0.1, 0.07, 0.05, 0.01, 0.002}) {
    auto lights = clusteredLights(texels, spread);
    EXPECT_EQ(moveKeyLightsFirst(lights), 0u) << spread;
  }
}

TEST(KeyLights, AreSmall) {
  std::vector<EnvironmentLight> lights = lightsOf({2, 2, 9, 9});
  lights[2].spread = 2 * kKeySpread;
  ASSERT_EQ(moveKeyLightsFirst(lights), 3u);
  EXPECT_GT(lights[3].spread, kKeySpread);
}

TEST(KeyLights, AreTheStrongestOfMany) {
  std::vector<EnvironmentLight> lights(1000, {{0, 1, 0}, {1, 1, 1}});
  for (size_t i = 0; i < 100; ++i) lights[9 * i].irradiance = {static_cast<float>(100 + i), 0, 0};
  ASSERT_EQ(moveKeyLightsFirst(lights), kMostKeyLights);
  EXPECT_EQ(lights[0].irradiance.r, static_cast<float>(200 - kMostKeyLights));
  EXPECT_EQ(lights[kMostKeyLights - 1].irradiance.r, 199);
}

TEST(KeyLights, SpreadIsThatOfTheMergedDirections) {
  const auto texels =
      environmentOf(image::randomImage(64, 32, 3, 0, 2, 4), EnvironmentMapping::latLong).lights;
  for (const EnvironmentLight& texel : texels) EXPECT_EQ(texel.spread, 0);
  for (const double spread : {0.3, 0.01}) {
    double energy = 0, spreads = 0;
    for (const EnvironmentLight& light : clusteredLights(texels, spread)) {
      const double strength = double{light.irradiance.r} + light.irradiance.g + light.irradiance.b;
      energy += strength;
      spreads += strength * light.spread;
    }
    EXPECT_LE(spreads / energy, spread * (1 + 1e-5));
    EXPECT_GT(spreads / energy, spread / 2);
  }
}

TEST(Gathered, KeepsTheLightOfEveryChannel) {
  const image::Image image = image::randomImage(64, 32, 3, 0, 2, 4);
  const auto texels = environmentOf(image, EnvironmentMapping::latLong).lights;
  const Rgb total = totalIrradiance(texels);
  for (const double spread : {1.0, 0.1, 0.01, 0.001}) {
    const auto lights = clusteredLights(texels, spread);
    EXPECT_NEAR(totalIrradiance(lights).r / total.r, 1, 3e-7);
    EXPECT_NEAR(totalIrradiance(lights).g / total.g, 1, 3e-7);
    EXPECT_NEAR(totalIrradiance(lights).b / total.b, 1, 3e-7);
    for (const auto& light : lights) EXPECT_NEAR(light.towards.raw().norm(), 1, 2e-7);
  }
}

TEST(Gathered, AConstantMapBecomesAboutTwoPiOverThreeSpreadsLights) {
  const auto texels =
      environmentOf(pictureOf(EnvironmentMapping::latLong, 64, constantOne), EnvironmentMapping::latLong)
          .lights;
  for (const double spread : {0.05, 0.01, 0.002}) {
    const auto count = static_cast<double>(clusteredLights(texels, spread).size());
    EXPECT_NEAR(count * spread / (2 * kPi / 3), 1, 0.16) << spread;
  }
}

TEST(Gathered, ASmallBrightSourceIsALightOfItsOwn) {
  std::mt19937 random(5);
  for (unsigned trial = 0; trial < 5; ++trial) {
    image::Image image = image::randomImage(128, 64, 3, 0.5f, 1, trial);
    const int x = static_cast<int>(random() % 128), y = static_cast<int>(20 + random() % 24);
    std::ranges::fill(image.at(x, y), 1e5f);
    const auto lights = clusteredLights(environmentOf(image, EnvironmentMapping::latLong).lights, 1e-3);
    const auto brightest =
        *std::ranges::max_element(lights, {}, [](const auto& light) { return light.irradiance.g; });
    const auto sun = latLongDirection((x + 0.5) / 128, (y + 0.5) / 64).cast<float>();
    EXPECT_LT((brightest.towards.raw() - sun.raw()).norm(), 1e-3);
  }
}

// The integral of a smooth function errs by at most half of the spread times its second derivative (k^2 for a
// ripple of k radians per radian), and in practice by far less, as errors cancel.
TEST(Gathered, IntegralsConvergeWithTheSpread) {
  std::mt19937 random(6);
  const auto texels =
      environmentOf(pictureOf(EnvironmentMapping::latLong, 128, lively), EnvironmentMapping::latLong).lights;
  const double total = integral(texels, constantOne);
  for (int trial = 0; trial < 5; ++trial) {
    const Vec3<double> a = randomUnit(random);
    const auto ripple = [&](const Vec3<double>& d) { return std::cos(5 * d.dot(a)); };
    const double exact = integral(texels, ripple);
    for (const double spread : {0.04, 0.01, 0.0025})
      EXPECT_LT(std::abs(integral(clusteredLights(texels, spread), ripple) - exact) / total, 25 * spread / 2)
          << spread;
  }
}

TEST(Gathered, ManyTexelsInOnePlaceAreOneLightAndNoneAreNone) {
  const EnvironmentLight one{{0, 1, 0}, {1, 2, 3}};
  EXPECT_EQ(clusteredLights({one, one, one}, 1e-6), (std::vector{EnvironmentLight{{0, 1, 0}, {3, 6, 9}}}));
  EXPECT_TRUE(clusteredLights({}, 1).empty());
}

TEST(Gathered, NeverExceedsItsLimit) {
  const auto texels =
      environmentOf(pictureOf(EnvironmentMapping::latLong, 64, constantOne), EnvironmentMapping::latLong)
          .lights;
  ASSERT_GT(texels.size(), kMaxClusteredLights);
  EXPECT_EQ(clusteredLights(texels, 1e-9).size(), kMaxClusteredLights);
}

class ReadEnvironment : public ::testing::Test {
protected:
  image::TemporaryFolder folder;
};

TEST_F(ReadEnvironment, ASquareNeedsAMapping) {
  for (const auto mapping : {EnvironmentMapping::angular, EnvironmentMapping::mirrorBall}) {
    const image::Image image = pictureOf(mapping, 64, lively);
    image::writeExr(folder / "map.exr", image, image::Precision::single);
    EXPECT_NE(
        image::errorOf([&] { readEnvironment(folder / "map.exr"); }).find("or a mapping (in a script, "),
        std::string::npos);
    EXPECT_EQ(readEnvironment(folder / "map.exr", mapping).lights, environmentOf(image, mapping).lights);
  }
}

TEST_F(ReadEnvironment, TwiceAsWideAsHighIsALatLong) {
  const image::Image image = pictureOf(EnvironmentMapping::latLong, 64, lively);
  image::writeExr(folder / "map.exr", image, image::Precision::single);
  EXPECT_EQ(readEnvironment(folder / "map.exr").lights,
            environmentOf(image, EnvironmentMapping::latLong).lights);
}

TEST_F(ReadEnvironment, StopsWithinARowOrACut) {
  const image::Image image = pictureOf(EnvironmentMapping::latLong, 64, lively);
  const auto texels = environmentOf(image, EnvironmentMapping::latLong).lights;
  int asked = 0;
  Progress later;
  later.cancelled = [&] { return ++asked == 20; };
  EXPECT_THROW(environmentOf(image, EnvironmentMapping::latLong, later), Cancelled);
  asked = 0;
  EXPECT_THROW(environmentOf(image, EnvironmentMapping::angular, later), Cancelled);
  asked = 0;
  EXPECT_THROW(clusteredLights(texels, 1e-3, later), Cancelled);
}

TEST_F(ReadEnvironment, RadianceFilesAreRead) {
  std::string file = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n";
  for (int i = 0; i < 8; ++i) file += i == 6 ? std::string("\x80\x40\x20\x82", 4) : std::string(4, '\0');
  image::writeBytes(folder / "sun.hdr", file);
  const auto map = readEnvironment(folder / "sun.hdr");
  const Rgb light = totalIrradiance(map.lights);
  EXPECT_NEAR(light.r, 2 * 4 * kPi / 8, 1e-6); // 128/256 2^(130 - 128) = 2, over an eighth of the sphere
  EXPECT_NEAR(light.g, light.r / 2, 1e-6);
  EXPECT_NEAR(light.b, light.r / 4, 1e-6);
  for (const EnvironmentLight& part : map.lights) { // column 2 of row 1
    EXPECT_GT(part.towards.x(), 0);
    EXPECT_LT(part.towards.y(), 0);
    EXPECT_LT(part.towards.z(), 0);
  }
}

TEST_F(ReadEnvironment, OtherPrimariesBecomeRec709) {
  std::string pixels;
  for (int i = 0; i < 8; ++i) pixels += i == 6 ? std::string("\x80\x40\x20\x82", 4) : std::string(4, '\0');
  image::writeBytes(folder / "sun.hdr", "#?RADIANCE\nPRIMARIES=0.68 0.32 0.265 0.69 0.15 0.06 0.3127 0.329\n"
                                        "FORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n" +
                                            pixels);
  const Rgb light = totalIrradiance(readEnvironment(folder / "sun.hdr").lights);
  const Vec3<double> expected = image::rec709From(image::kDisplayP3) * Vec3<double>(2, 1, 0.5) * kPi / 2;
  EXPECT_NEAR(light.r, expected[0], 1e-6);
  EXPECT_NEAR(light.g, expected[1], 1e-6);
  EXPECT_NEAR(light.b, expected[2], 1e-6);
}

TEST_F(ReadEnvironment, WhatIsNoEnvironmentIsRefusedByName) {
  const auto complaint = [&](const char* name) {
    return image::errorOf([&] { readEnvironment(folder / name); });
  };
  image::writeExr(folder / "wide.exr", image::Image(9, 3, 3));
  EXPECT_NE(complaint("wide.exr").find("wide.exr: found 9 x 3, expected twice"), std::string::npos);
  EXPECT_NO_THROW(readEnvironment(folder / "wide.exr", EnvironmentMapping::latLong));
  image::writeExr(folder / "cross.exr", image::Image(6, 8, 3));
  EXPECT_NE(complaint("cross.exr").find("cross.exr: found 6 x 8 (a cube cross?), expected twice"),
            std::string::npos);
  image::writePng(folder / "map.png", image::Image(4, 2, 3));
  EXPECT_NE(complaint("map.png").find("found 8-bit samples, expected radiance in floating point"),
            std::string::npos);
  EXPECT_NE(complaint("missing.exr").find("missing.exr"), std::string::npos);
  image::writeBytes(folder / "huge.hdr", "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8192 +X 16384\n");
  EXPECT_NE(complaint("huge.hdr").find("found 16384 x 8192, expected an environment of at most"),
            std::string::npos);
  image::Image bright(4, 2, 3);
  std::ranges::fill(bright.values, 3e38f);
  image::writeExr(folder / "bright.exr", bright, image::Precision::single);
  EXPECT_NE(complaint("bright.exr").find("within float"), std::string::npos);
}

} // namespace
} // namespace surflect::weights
