#include "render/lightfield/common/light_field_renderer.h"

#include "render/methods.h"
#include "srf/image/resize.h"
#include "surfel/base/error.h"
#include "tests/support/given_up.h"
#include "tests/support/synthetic_capture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace surflect::lightfield {
namespace {

constexpr int kPicture = 48;

std::vector<std::string> bakedTags() {
  std::vector<std::string> tags;
  for (const method::Method& method : method::methods())
    if (method.isBaked) tags.push_back(method.tag);
  return tags;
}

method::Setting buildSetting(const std::string& tag) {
  if (tag == "slf") return {{"regions", 20}, {"texels", 4000}, {"directions", 18}};
  if (tag == "lumigraph") return {{"st", 3}, {"texels", 100000}};
  if (tag == "lfm" || tag == "olfm") return {{"triangles", 600}, {"samples", 5}, {"view_size", 8}};
  if (tag == "vdtm" || tag == "ulr") return {{"triangles", 600}};
  if (tag == "spherical") return {{"levels", 2}, {"size", 64}};
  return {};
}

double rmsBetween(const image::Image& a, const image::Image& b) {
  EXPECT_EQ(a.values.size(), b.values.size());
  double squares = 0;
  for (size_t i = 0; i < a.values.size(); ++i)
    squares += std::pow(static_cast<double>(a.values[i] - b.values[i]), 2);
  return std::sqrt(squares / static_cast<double>(a.values.size()));
}

// A matte sphere as a light field of each method. A model is built when it is first asked for.
class LightFieldRendererTest : public ::testing::TestWithParam<std::string> {
protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<image::TemporaryFolder>();
    studio::photograph({.cameras = 40, .lights = 0, .size = kPicture}, *folder_ / "capture");
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static scene::Scene sceneFrom(const Vec3<double>& direction, const warp::Warp& warp) {
    return {warp, studio::cameraFrom<ObjectSpace>(direction, kPicture), {}};
  }
  static const method::Method& tested() { return method::methodOf(GetParam()); }
  static std::filesystem::path model() {
    const std::filesystem::path folder = *folder_ / GetParam();
    if (!std::filesystem::exists(folder)) {
      const method::Setting setting = buildSetting(GetParam());
      method::requireSetting({GetParam(), tested().buildOptions}, setting);
      tested().build({.source = *folder_ / "capture",
                      .mesh = {},
                      .stageScale = {},
                      .output = folder,
                      .say = [](std::string_view) {}},
                     setting, {});
    }
    return folder;
  }
  static std::unique_ptr<method::Renderer> opened(const method::Setting& setting = {}) {
    return method::openRenderer(model(), setting);
  }

  static inline std::unique_ptr<image::TemporaryFolder> folder_;
  const warp::WarpPointer rest_ = warp::chainWarp({});
};

TEST_P(LightFieldRendererTest, ShowsTheObjectFromNewViewpointsUnderEveryPreset) {
  for (const auto preset : {method::Preset::full, method::Preset::preview, method::Preset::paper}) {
    const method::Setting setting = method::settingOf(preset, tested().renderOptions);
    const auto renderer = opened(setting);
    for (const Vec3<double>& direction : {Vec3<double>(1, 2, 3), Vec3<double>(-3, 0.5, 1)}) {
      const image::Image color = renderer->render(sceneFrom(direction, *rest_)).color;
      const auto camera = studio::cameraFrom<AcquisitionSpace>(direction, kPicture);
      const image::Image truth = studio::overBlack(studio::viewSphere(camera, 3), studio::fixedRadiance);
      const double rms = rmsBetween(color, truth);
      RecordProperty("rms", std::to_string(rms));
      EXPECT_LE(rms, preset == method::Preset::full ? 0.07 : 0.12) << method::textOf(setting);
    }
  }
}

TEST_P(LightFieldRendererTest, DescribesItsModel) {
  const auto renderer = opened();
  const method::Description& description = renderer->describe();
  EXPECT_EQ(description.folder, model());
  EXPECT_EQ(description.method, GetParam());
  EXPECT_EQ(description.rig.views.size(), 40u);
  EXPECT_TRUE(description.isBaked);
  EXPECT_FALSE(description.points.empty());
  EXPECT_LE(description.middle.raw().norm(), 0.05);
}

TEST_P(LightFieldRendererTest, LightsAndWarpsAreRefused) {
  const auto renderer = opened();
  scene::Scene lit = sceneFrom({1, 0, 0}, *rest_);
  lit.lights.emplace_back(scene::ShotDirectionalLight{{0, 0, 1}, {1, 1, 1}});
  EXPECT_THROW(renderer->render(lit), Error);
  const warp::WarpPointer larger = warp::scaleWarp({2, 2, 2}, {0, 0, 0});
  EXPECT_THROW(renderer->render(sceneFrom({1, 0, 0}, *larger)), Error);
}

TEST_P(LightFieldRendererTest, PixelsAreMeansOfTheirSamples) {
  const auto renderer = opened({{"samples", 3}});
  const scene::Scene scene = sceneFrom({1, 2, 3}, *rest_);
  const method::FrameLayers means = renderer->render(scene);
  renderer->set({{"samples", 1}});
  scene::Scene larger = scene;
  larger.camera.lens = capture::resized(scene.camera.lens, 3 * kPicture, 3 * kPicture);
  const image::Image expected = image::squareMeans(renderer->render(larger).color, 3);
  ASSERT_EQ(means.color.values.size(), expected.values.size());
  size_t partly = 0;
  for (size_t i = 0; i < expected.values.size(); ++i) {
    EXPECT_NEAR(means.color.values[i], expected.values[i], 1e-5f);
    partly += i % 4 == 3 && expected.values[i] > 0 && expected.values[i] < 1;
  }
  EXPECT_GT(partly, 50u);
}

TEST_P(LightFieldRendererTest, SeveralStandSideBySideAndEqualScenesHaveEqualBits) {
  const auto one = opened(), other = opened(), coarse = opened({{"samples", 1}});
  const scene::Scene scene = sceneFrom({1, 1, 1}, *rest_);
  const std::vector<float> before = one->render(scene).color.values;
  other->render(sceneFrom({-1, 0, 2}, *rest_));
  EXPECT_EQ(other->render(scene).color.values, before);
  EXPECT_NE(coarse->render(scene).color.values, before);
  EXPECT_EQ(one->render(scene).color.values, before);
  EXPECT_EQ(one->describe().identity, other->describe().identity);
  EXPECT_NE(one->describe().identity, coarse->describe().identity);
}

TEST_P(LightFieldRendererTest, ASettingGivesThePictureOfARendererThatIsOpenedWithIt) {
  const auto renderer = opened(), coarse = opened({{"samples", 1}});
  const scene::Scene scene = sceneFrom({1, 2, 3}, *rest_);
  const method::FrameLayers full = renderer->render(scene);
  renderer->set({{"samples", 1}});
  EXPECT_EQ(renderer->render(scene).color.values, coarse->render(scene).color.values);
  EXPECT_EQ(renderer->describe().identity, coarse->describe().identity);
  renderer->set({});
  EXPECT_EQ(renderer->render(scene).color.values, full.color.values);
}

TEST_P(LightFieldRendererTest, ASettingThatIsRefusedChangesNothing) {
  const auto renderer = opened();
  const scene::Scene scene = sceneFrom({1, 0, 0}, *rest_);
  const std::vector<float> before = renderer->render(scene).color.values;
  const std::string identity = renderer->describe().identity;
  for (const method::Setting& setting :
       {method::Setting{{"samples", 0}}, {{"samples", 1.5}}, {{"samples", "on"}}, {{"no_option", 1}}}) {
    EXPECT_THROW(renderer->set(setting), Error);
    EXPECT_EQ(renderer->describe().identity, identity);
    EXPECT_EQ(renderer->render(scene).color.values, before);
  }
  EXPECT_EQ(image::errorOf([&] {
              renderer->set({{"samples", 9}});
            }),
            "--samples: found 9, expected 1..8, whole");
  EXPECT_EQ(image::errorOf([&] { opened({{"samples", 9}}); }), "--samples: found 9, expected 1..8, whole");
}

TEST_P(LightFieldRendererTest, OptionsOfOpeningCannotBeSetLater) {
  const auto renderer = opened();
  for (const method::Option& option : renderer->options()) {
    if (!option.atOpening) continue;
    EXPECT_THROW(renderer->set({{option.name, *option.standard}}), Error) << option.name;
  }
}

TEST_P(LightFieldRendererTest, EveryKnobTakesItsValuesAndBeginsWithTheDefault) {
  const auto renderer = opened();
  const scene::Scene scene = sceneFrom({1, 0, 0}, *rest_);
  for (const method::Option& knob : renderer->options()) {
    if (knob.sweep.empty()) continue;
    EXPECT_EQ(knob.sweep.front().text(), knob.standard.value_or(method::Value("none")).text()) << knob.name;
    std::set<std::string> identities;
    for (const method::Value& value : knob.sweep) {
      renderer->set({{knob.name, value}});
      identities.insert(renderer->describe().identity);
      EXPECT_FALSE(renderer->render(scene).report.remark) << knob.name << " " << value.text();
    }
    EXPECT_EQ(identities.size(), knob.sweep.size()) << knob.name;
  }
}

TEST_P(LightFieldRendererTest, SaysWhatAFrameTookAndWhetherNothingIsVisible) {
  const auto renderer = opened();
  scene::Scene scene = sceneFrom({0, 0, 1}, *rest_);
  const method::FrameReport report = renderer->render(scene).report;
  EXPECT_FALSE(report.remark);
  EXPECT_FALSE(report.seconds.empty());
  double work = 0;
  for (const auto& [name, count] : report.counts)
    if (name.starts_with("work.")) work += count;
  EXPECT_GT(work, 0);
  const Mat3<double> turned = Vec3<double>(-1, 1, -1).asDiagonal(); // looks away from the object
  scene.camera.cameraFromWorld = {turned * scene.camera.cameraFromWorld.rotation(),
                                  turned * scene.camera.cameraFromWorld.translation()};
  EXPECT_EQ(renderer->render(scene).report.remark, "no part of the object is visible");
}

TEST_P(LightFieldRendererTest, AovsAreThoseThatAreAskedAndThatTheMethodHas) {
  const auto renderer = opened();
  const scene::Scene scene = sceneFrom({1, 2, 3}, *rest_);
  EXPECT_TRUE(renderer->render(scene).aovs.empty());
  const method::FrameLayers layers = renderer->render(scene, {"depth", "normal"});
  const auto& known = renderer->describe().aovs;
  if (std::ranges::find(known, "depth") == known.end()) {
    EXPECT_TRUE(layers.aovs.empty());
    return;
  }
  ASSERT_EQ(layers.aovs.size(), 1u);
  const image::Image& depth = layers.aovs.at("depth");
  EXPECT_NEAR(depth.at(kPicture / 2, kPicture / 2)[0], studio::cameraDistance - 1, 0.15);
  for (size_t pixel = 0; pixel < depth.values.size(); ++pixel)
    EXPECT_EQ(std::isinf(depth.values[pixel]), layers.color.values[4 * pixel + 3] == 0);
}

// Position is the visible point, premultiplied by alpha, as it is for surfels; rest is equal, as nothing
// bends.
TEST_P(LightFieldRendererTest, PositionIsTheVisiblePointOfTheSphere) {
  const auto renderer = opened();
  if (std::ranges::find(renderer->describe().aovs, "position") == renderer->describe().aovs.end()) {
    EXPECT_TRUE(renderer->render(sceneFrom({1, 2, 3}, *rest_), {"position"}).aovs.empty());
    return;
  }
  const scene::Scene scene = sceneFrom({1, 2, 3}, *rest_);
  const method::FrameLayers layers = renderer->render(scene, {"position", "rest"});
  ASSERT_EQ(layers.aovs.size(), 2u);
  const image::Image& position = layers.aovs.at("position");
  EXPECT_EQ(position.values, layers.aovs.at("rest").values);
  const studio::SphereView truth =
      studio::viewSphere(studio::cameraFrom<AcquisitionSpace>({1, 2, 3}, kPicture), 1);
  size_t opaque = 0;
  for (int y = 0; y < kPicture; ++y)
    for (int x = 0; x < kPicture; ++x) {
      const float alpha = layers.color.at(x, y)[3];
      const Vec3<float> point(position.at(x, y).data());
      if (alpha == 0) {
        EXPECT_EQ(point, Vec3<float>::Zero());
      }
      if (alpha != 1) continue;
      const auto place = assume<Point3<ObjectSpace, double>>(point);
      const std::optional<capture::Pixel> pixel = scene.camera.project(place);
      ASSERT_TRUE(pixel);
      EXPECT_LT(std::hypot(pixel->x - x - 0.5, pixel->y - y - 0.5), 2e-6);
      const auto number = static_cast<size_t>(y * kPicture + x);
      if (truth.first[number] == truth.first[number + 1]) continue;
      const Vec3<float> onSphere = truth.normals[truth.first[number]];
      const Vec3<double> towards = (scene.camera.center() - place).raw().normalized();
      if (onSphere.cast<double>().dot(towards) < 0.5) continue; // depth of the nearest sample
      ++opaque;
      EXPECT_LT((point - onSphere).norm(), 0.045);
    }
  EXPECT_GT(opaque, 300u);
}

TEST_P(LightFieldRendererTest, AFrameThatIsGivenUpAnywhereLeavesTheNextAsItIs) {
  const auto renderer = opened();
  const scene::Scene scene = sceneFrom({1, 2, 3}, *rest_), other = sceneFrom({-2, 1, 1}, *rest_);
  const std::vector<float> expected = renderer->render(scene).color.values,
                           whole = renderer->render(other).color.values;
  const size_t given = giveUpEverywhere(
      [&](const Progress& progress) {
        EXPECT_EQ(renderer->render(other, {"depth"}, progress).color.values, whole);
      },
      [&] { EXPECT_EQ(renderer->render(scene).color.values, expected); });
  EXPECT_GE(given, 3u);
}

TEST_P(LightFieldRendererTest, AnotherFolderIsRefused) {
  EXPECT_THROW(tested().open(*folder_ / "capture", {}, {}), Error);
  EXPECT_THROW(tested().open(*folder_ / "nothing", {}, {}), Error);
}

INSTANTIATE_TEST_SUITE_P(Methods, LightFieldRendererTest, ::testing::ValuesIn(bakedTags()),
                         [](const auto& instance) { return instance.param; });

} // namespace
} // namespace surflect::lightfield
