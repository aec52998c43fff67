#include "render/lightfield/common/relight.h"

#include "render/lightfield/common/views.h"
#include "srf/capture/photograph.h"
#include "srf/image/exr.h"
#include "srf/weights/environment_map.h"
#include "tests/support/synthetic_capture.h"
#include "tests/support/text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <random>

namespace surflect::lightfield {
namespace {

using scene::ShotLight;

constexpr size_t kLights = 7;

ShotLight directional(const Vec3<double>& towards, const Rgb& irradiance) {
  return scene::ShotDirectionalLight{assume<Direction3<ObjectSpace, double>>(towards.normalized()),
                                     irradiance};
}

ShotLight ownLight(const capture::Light& light, float factor) {
  auto own = std::get<scene::ShotDirectionalLight>(scene::inObjectSpace(light));
  own.irradiance = factor * own.irradiance;
  return own;
}

ShotLight environment(const image::Image& radiance) {
  return scene::ShotEnvironment{std::make_shared<const weights::EnvironmentMap>(
                                    weights::environmentOf(radiance, weights::EnvironmentMapping::latLong)),
                                Rotation<ObjectSpace, EnvironmentSpace>()};
}

image::Image whiteSky() {
  image::Image sky(64, 32, 3);
  std::ranges::fill(sky.values, 1.f);
  return sky;
}

capture::Photograph randomPhotograph(std::mt19937& random, bool withAlpha) {
  std::uniform_real_distribution<float> unit;
  capture::Photograph photograph{image::Image(5, 4, 3), image::Image(5, 4, 1)};
  for (float& value : photograph.radiance.values) value = 4 * unit(random);
  for (float& alpha : photograph.alpha.values) alpha = withAlpha ? std::max(0.f, unit(random) - 0.2f) : 1;
  for (size_t i = 0; i < photograph.radiance.values.size(); ++i)
    if (photograph.alpha.values[i / 3] == 0) photograph.radiance.values[i] = 0;
  photograph.hasMatte = withAlpha;
  return photograph;
}

TEST(WeightedSum, OnePhotographIsExactlyMultipliedByItsWeight) {
  std::mt19937 random(1);
  for (const Rgb& weight : {Rgb{1, 1, 1}, {3, 0.1f, 7.7f}, {0, 1e-4f, 1234.567f}}) {
    const capture::Photograph photograph = randomPhotograph(random, true);
    const capture::Photograph sum = weightedSum({&photograph, 1}, {&weight, 1});
    EXPECT_EQ(sum.alpha.values, photograph.alpha.values);
    const std::array channels = {weight.r, weight.g, weight.b};
    for (size_t i = 0; i < sum.radiance.values.size(); ++i)
      EXPECT_EQ(sum.radiance.values[i], channels[i % 3] * photograph.radiance.values[i]);
  }
}

TEST(WeightedSum, IsLinearInTheWeightsAndKeepsTheUnionOfMattes) {
  std::mt19937 random(2);
  std::vector<capture::Photograph> photographs;
  std::vector<Rgb> a, b, both;
  std::uniform_real_distribution<float> unit;
  for (int p = 0; p < 6; ++p) {
    photographs.push_back(randomPhotograph(random, true));
    a.push_back({unit(random), unit(random), unit(random)});
    b.push_back({unit(random), 2 * unit(random), -unit(random)});
    both.push_back(a.back() + b.back());
  }
  const capture::Photograph ofA = weightedSum(photographs, a), ofB = weightedSum(photographs, b),
                            ofBoth = weightedSum(photographs, both);
  for (size_t i = 0; i < ofBoth.radiance.values.size(); ++i)
    EXPECT_NEAR(ofBoth.radiance.values[i], ofA.radiance.values[i] + ofB.radiance.values[i], 1e-5);
  for (size_t i = 0; i < ofA.radiance.values.size(); i += 3) { // premultiplied red
    float red = 0;
    for (size_t p = 0; p < photographs.size(); ++p)
      red += a[p].r * photographs[p].alpha.values[i / 3] * photographs[p].radiance.values[i];
    EXPECT_NEAR(ofA.radiance.values[i] * ofA.alpha.values[i / 3], red, 1e-5);
  }
  for (size_t i = 0; i < ofBoth.alpha.values.size(); ++i) {
    float widest = 0;
    for (const capture::Photograph& photograph : photographs)
      widest = std::max(widest, photograph.alpha.values[i]);
    EXPECT_EQ(ofBoth.alpha.values[i], widest);
  }
}

TEST(PhotographWeights, ALightOnItsOwnCapturedLightIsThatPhotographTimesTheRatioOfStrengths) {
  const std::vector<capture::Light> lights = studio::studioLights(kLights);
  for (size_t own = 0; own < kLights; ++own)
    for (const float factor : {1.f, 3.f, 0.5f}) {
      const std::array shot = {ownLight(lights[own], factor)};
      const std::vector<Rgb> weights = photographWeights(lights, {0.3, 0, 0}, shot);
      for (size_t l = 0; l < kLights; ++l)
        EXPECT_EQ(weights[l], (l == own ? Rgb{factor, factor, factor} : Rgb{})) << own << ' ' << l;
    }
}

TEST(PhotographWeights, APointLightIsComparedAtTheMiddleOfTheObject) {
  std::vector<capture::Light> lights = studio::studioLights(kLights);
  lights.push_back({"P", "P", capture::PointLight{{0, 3, 1}, {8, 4, 2}}});
  const std::array same = {ShotLight(scene::ShotPointLight{{0, 3, 1}, {16, 16, 16}})};
  const std::vector<Rgb> weights = photographWeights(lights, {0, 1, 1}, same);
  EXPECT_EQ(weights.back(), (Rgb{2, 4, 8}));
  EXPECT_EQ(std::ranges::count(weights, Rgb{}), static_cast<long>(kLights));
  const std::array inside = {ShotLight(scene::ShotPointLight{{0, 1, 1}, {16, 16, 16}})};
  EXPECT_NE(image::errorOf([&] {
              photographWeights(lights, {0, 1, 1}, inside);
            }).find("light[0]"),
            std::string::npos);
}

TEST(PhotographWeights, LightsBetweenCapturedOnesAddUp) {
  const std::vector<capture::Light> lights = studio::studioLights(kLights);
  const ShotLight red = directional({1, 2, 3}, {5, 0, 0}), blue = directional({-1, 0.3, 2}, {0, 0, 7});
  const std::vector<ShotLight> onlyRed = {red}, onlyBlue = {blue}, both = {red, blue};
  const std::vector<Rgb> r = photographWeights(lights, {0, 0, 0}, onlyRed),
                         b = photographWeights(lights, {0, 0, 0}, onlyBlue),
                         rb = photographWeights(lights, {0, 0, 0}, both);
  float irradiance = 0;
  for (size_t l = 0; l < kLights; ++l) {
    EXPECT_EQ(rb[l], r[l] + b[l]);
    irradiance += rb[l].r * capture::irradianceAt(lights[l], {0, 0, 0}).r;
  }
  EXPECT_NEAR(irradiance, 5, 1e-5);
}

TEST(PhotographWeights, UnderAWhiteSkyAPhotographWeighsTheSolidAngleNearestToItsLight) {
  const std::vector<capture::Light> lights = studio::studioLights(kLights);
  const std::array shot = {environment(whiteSky())};
  const std::vector<Rgb> weights = photographWeights(lights, {0, 0, 0}, shot);
  // Solid angles by counting random directions.
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::vector<double> solidAngle(kLights);
  constexpr int kDirections = 40000;
  std::vector<Direction3<AcquisitionSpace, double>> towards;
  for (const capture::Light& light : lights) towards.push_back(capture::towardsLight(light, {0, 0, 0}));
  for (int i = 0; i < kDirections; ++i)
    solidAngle[nearestLight(towards, {normal(random), normal(random), normal(random)})] +=
        4 * std::numbers::pi / kDirections;
  double sum = 0;
  for (size_t l = 0; l < kLights; ++l) {
    const Rgb own = capture::irradianceAt(lights[l], {0, 0, 0});
    EXPECT_NEAR(weights[l].r * own.r / solidAngle[l], 1, 0.05);
    EXPECT_NEAR(weights[l].b * own.b, weights[l].r * own.r, 1e-5);
    sum += weights[l].r * own.r;
  }
  EXPECT_NEAR(sum, 4 * std::numbers::pi, 1e-4);
}

// Views 0..4 are for training; view 5 is for the test and lacks light 0. All have a photograph for the test
// under the last light.
class Relight : public ::testing::Test {
protected:
  static constexpr size_t kTestView = 5;

  static studio::Studio small() {
    studio::Studio studio{.cameras = 6, .lights = kLights, .size = 24, .samples = 2};
    studio.split = [](size_t view, size_t light) -> std::optional<capture::Split> {
      if (view == kTestView && light == 0) return std::nullopt;
      return view == kTestView || light == kLights - 1 ? capture::Split::test : capture::Split::train;
    };
    return studio;
  }

  Relight() { studio::photograph(small(), folder_ / "capture"); }

  RelightReport run(const std::vector<ShotLight>& lights, Incomplete incomplete, const std::string& name) {
    const RelightPlan plan = planRelight(capture(), lights, incomplete);
    return relight(capture(), plan, folder_ / name);
  }
  capture::Capture capture() const { return capture::readCapture(folder_ / "capture"); }

  // Stored channels R, G, B and A of a view, and of a photograph.
  image::Image stored(const std::string& name, size_t view) const {
    return image::ExrFile(folder_ / name / "images" / ("C" + std::to_string(view) + ".exr"))
        .read({"R", "G", "B", "A"});
  }
  image::Image photograph(size_t view, size_t light) const {
    const std::string layer = "L" + std::to_string(light);
    return image::ExrFile(folder_ / "capture" / ("C" + std::to_string(view) + ".exr"))
        .read({layer + ".R", layer + ".G", layer + ".B", "matte.A"});
  }

  image::TemporaryFolder folder_;
};

TEST_F(Relight, UnderACapturedLightAViewIsItsPhotographBitForBit) {
  for (const size_t light : {1, 4}) {
    const std::string name = "own" + std::to_string(light);
    run({ownLight(capture().lights[light], 1)}, Incomplete::refused, name);
    for (size_t view = 0; view < 6; ++view)
      EXPECT_EQ(stored(name, view).values, photograph(view, light).values) << view;
  }
}

TEST_F(Relight, AViewIsTheSumOfPhotographsToHalfRounding) {
  const std::vector<ShotLight> lights = {environment(whiteSky())};
  const RelightPlan plan = planRelight(capture(), lights, Incomplete::common);
  EXPECT_EQ(plan.lights.size(), kLights - 2);
  relight(capture(), plan, folder_ / "sky");
  for (size_t view = 0; view < 6; ++view) {
    const image::Image got = stored("sky", view);
    std::vector<double> wanted(got.values.size());
    for (size_t l = 0; l < plan.lights.size(); ++l) {
      const image::Image one = photograph(view, l + 1);
      const std::array weights = {plan.weights[l].r, plan.weights[l].g, plan.weights[l].b};
      for (size_t i = 0; i < wanted.size(); ++i)
        if (i % 4 < 3) wanted[i] += double{weights[i % 4]} * one.values[i];
    }
    for (size_t i = 0; i < wanted.size(); ++i)
      if (i % 4 < 3) {
        ASSERT_NEAR(got.values[i], wanted[i], 1e-7 + wanted[i] / 2000);
      }
  }
}

TEST_F(Relight, HoldOutsStayHoldOutsAndLightsOfTheTestAloneDoNotTakePart) {
  run({environment(whiteSky())}, Incomplete::common, "views");
  const capture::Capture views = capture::readCapture(folder_ / "views"), all = capture();
  ASSERT_EQ(views.frames.size(), 6u);
  EXPECT_TRUE(views.lights.empty());
  for (const capture::Frame& frame : views.frames) {
    const capture::View& view = views.views[frame.view];
    EXPECT_EQ(frame.split, view.identity == "C5" ? capture::Split::test : capture::Split::train);
    const auto same = std::ranges::find(all.views, view.identity, &capture::View::identity);
    ASSERT_NE(same, all.views.end());
    EXPECT_EQ(view.camera.lens, same->camera.lens);
    EXPECT_TRUE(view.camera.cameraFromWorld.rotation().isApprox(same->camera.cameraFromWorld.rotation()));
  }
}

TEST_F(Relight, AMissingPhotographIsNamedLeftOutOrAvoided) {
  const std::vector<ShotLight> sky = {environment(whiteSky())};
  const std::string line = image::errorOf([&] { planRelight(capture(), sky, Incomplete::refused); });
  for (const char* said : {"view C5", "light L0", "1 of 6 views", "the 5 lights"})
    EXPECT_NE(line.find(said), std::string::npos) << line;
  const RelightPlan fewer = planRelight(capture(), sky, Incomplete::skipped);
  EXPECT_EQ(fewer.skipped, std::vector<std::string>{"C5"});
  EXPECT_EQ(fewer.lights.size(), kLights - 1);
  // A light that needs no photograph under the missing one.
  EXPECT_EQ(planRelight(capture(), std::vector{ownLight(capture().lights[2], 1)}, Incomplete::refused)
                .views.frames.size(),
            6u);
  EXPECT_NE(image::errorOf([&] {
              planRelight(capture(), std::vector{directional({1, 0, 0}, {})}, Incomplete::refused);
            }).find("darkness"),
            std::string::npos);
}

TEST_F(Relight, AnInterruptedRunGoesOnToTheSameBytesAndForeignFoldersAreRefused) {
  const std::vector<ShotLight> sky = {environment(whiteSky())};
  run(sky, Incomplete::common, "whole");
  const auto whole = image::contentOf(folder_ / "whole");
  const RelightPlan plan = planRelight(capture(), sky, Incomplete::common);
  Progress stopping;
  stopping.report = [](std::string_view, double) {};
  stopping.cancelled = [&] { return std::filesystem::exists(folder_ / "part/images/C1.exr"); };
  EXPECT_THROW(relight(capture(), plan, folder_ / "part", stopping), Cancelled);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "part/transforms.json"));
  EXPECT_GE(relight(capture(), plan, folder_ / "part").resumedViews, 2u);
  EXPECT_EQ(image::contentOf(folder_ / "part"), whole);
  EXPECT_NE(image::errorOf([&] {
              run({ownLight(capture().lights[2], 1)}, Incomplete::common, "whole");
            }).find("other lights"),
            std::string::npos);
  EXPECT_THROW(run(sky, Incomplete::common, "capture"), Error);
  EXPECT_EQ(image::contentOf(folder_ / "whole"), whole);
}

TEST_F(Relight, APictureHasSingleFloatsWhereAPhotographHas) {
  const std::vector<image::ChannelSet> sets = {{"L2.R", "L2.G", "L2.B"}, {"matte.A"}};
  const std::filesystem::path picture = folder_ / "capture/C1.exr";
  const std::vector<image::Image> images = image::ExrFile(picture).read(sets);
  image::writeExr(picture, std::vector<image::ExrLayer>{{sets[0], images.data(), image::Precision::single},
                                                        {sets[1], &images[1]}});
  run({ownLight(capture().lights[2], 1)}, Incomplete::refused, "views");
  const auto precision = [&](const char* name) {
    return image::ExrFile(folder_.path() / "views/images" / name).precision("G");
  };
  EXPECT_EQ(precision("C1.exr"), image::Precision::single);
  EXPECT_EQ(precision("C2.exr"), image::Precision::half);
  EXPECT_EQ(stored("views", 1).values, photograph(1, 2).values);
}

TEST_F(Relight, ViewsAreReadOneByOneOverBlackWithTheirSplit) {
  run({environment(whiteSky())}, Incomplete::common, "views");
  const Views views(folder_ / "views", {.plainPinholes = true});
  ASSERT_EQ(views.size(), 6u);
  EXPECT_GT(views.mesh().triangles.size(), 100u);
  EXPECT_EQ(views.ofSplit(capture::Split::test), std::vector<size_t>{kTestView});
  for (size_t view = 0; view < views.size(); ++view) {
    const image::Image got = views.read(view), wanted = stored("views", view);
    ASSERT_EQ(got.channels, 4);
    for (size_t i = 0; i < wanted.values.size(); ++i)
      ASSERT_NEAR(got.values[i], wanted.values[i], 1e-6 * (1 + wanted.values[i]));
    EXPECT_EQ(views.name(view), "C" + std::to_string(view));
    EXPECT_TRUE(std::filesystem::exists(views.picture(view)));
  }
}

TEST_F(Relight, WithoutAMatteAViewHasTheSilhouetteOfTheMesh) {
  studio::Studio bare = small();
  bare.matte = false;
  studio::photograph(bare, folder_ / "bare");
  const capture::Capture all = capture::readCapture(folder_ / "bare");
  relight(all, planRelight(all, std::vector{environment(whiteSky())}, Incomplete::common), folder_ / "views");
  EXPECT_FALSE(image::ExrFile(folder_ / "views/images/C0.exr").has("A"));
  const image::Image view = Views(folder_ / "views").read(0);
  EXPECT_EQ(view.at(12, 12)[3], 1);
  EXPECT_EQ(view.at(0, 0)[3], 0);
  EXPECT_EQ(view.at(0, 0)[0], 0);
  const std::filesystem::path json = folder_ / "views/transforms.json";
  image::writeBytes(json, replaced(readFile(json), "\"geometry\"", "\"_geometry\""));
  EXPECT_NE(image::errorOf([&] { Views views(folder_ / "views"); }).find("neither geometry nor mattes"),
            std::string::npos);
}

TEST_F(Relight, WhatIsNoInputOfALightFieldIsOneLine) {
  const auto line = [](const std::filesystem::path& folder) {
    return image::errorOf([&] { Views views(folder, {.plainPinholes = true}); });
  };
  EXPECT_NE(line(folder_ / "capture").find("lights: found 7 lights"), std::string::npos);
  run({environment(whiteSky())}, Incomplete::common, "views");
  const std::filesystem::path json = folder_ / "views/transforms.json";
  const std::string text = readFile(json);
  image::writeBytes(json, replaced(text, "\"geometry\"", "\"_geometry\""));
  EXPECT_EQ(Views(folder_ / "views").geometry().origin, proxy::Impostor::Origin::hull);
  EXPECT_EQ(Views(folder_ / "views", {.mesh = folder_ / "views/mesh.ply"}).geometry().origin,
            proxy::Impostor::Origin::given);
  image::writeBytes(json, replaced(text, "\"w\"", "\"k1\": 0.01, \"w\""));
  EXPECT_NE(line(folder_ / "views").find("view C0: k1: found 0.01"), std::string::npos);
  EXPECT_NO_THROW(Views(folder_ / "views"));
  image::writeBytes(json, text);
  std::filesystem::resize_file(folder_ / "views/images/C3.exr", 400);
  const Views views(folder_ / "views");
  EXPECT_NE(image::errorOf([&] { views.read(3); }).find("C3.exr"), std::string::npos);
  EXPECT_NE(image::errorOf([&] {
              planRelight(capture::readCapture(folder_ / "views"), {}, Incomplete::refused);
            }).find("lights: missing"),
            std::string::npos);
}

} // namespace
} // namespace surflect::lightfield
