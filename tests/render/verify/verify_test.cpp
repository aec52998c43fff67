#include "render/verify/block_checks.h"
#include "render/verify/frame_checks.h"
#include "render/verify/model_checks.h"
#include "render/verify/page.h"

#include "render/surfels/surfel_method.h"
#include "surfel/base/error.h"
#include "tests/render/films.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

namespace surflect::verify {
namespace {

using studio::cameraFrom;
using studio::PackedStudio;
using studio::pictureSize;
using studio::Studio;

const Check& checkOf(const std::vector<Check>& checks, std::string_view name) {
  const auto found =
      std::ranges::find_if(checks, [&](const Check& check) { return check.rule->name == name; });
  EXPECT_NE(found, checks.end()) << name;
  return *found;
}

class VerifySphere : public studio::PackedSphere<2000> {
protected:
  const std::vector<scene::ShotLight> lights{scene::ShotDirectionalLight{{0.6, 0, 0.8}, {3, 3, 3}}};

  FrameFindings findingsOf(const warp::Warp& warp, const Bounds& bounds = {}) {
    surfels::FrameWorkspace workspace(model(), size_t{1} << 26);
    return frameChecks(model(), {warp, camera, lights}, {}, workspace, bounds);
  }
};

warp::WarpPointer expression(const std::string& x, const std::string& y, const std::string& z) {
  return warp::expressionWarp(warp::Expression(x, warp::warpVariables),
                              warp::Expression(y, warp::warpVariables),
                              warp::Expression(z, warp::warpVariables), {});
}

TEST_F(VerifySphere, AGoodModelKeepsAllBounds) {
  for (const Check& check : modelChecks(model(), {}, {}))
    EXPECT_NE(check.verdict, Verdict::broken) << check.rule->name << ": " << check.finding;
  for (const Check& check : findingsOf(*studio::noWarp()).checks)
    EXPECT_NE(check.verdict, Verdict::broken) << check.rule->name << ": " << check.finding;
}

TEST_F(VerifySphere, PhotographsComeBackForEveryInterpolation) {
  for (const char* kind : {"paper", "separate", "kriging"}) {
    const method::Setting setting{{"interpolation", kind}};
    surfels::SurfelRenderer renderer(std::make_shared<model::Model>(model::openModel(model().folder)),
                                     setting);
    const Exactness exactness =
        exactnessOf(model(), renderer, surfels::frameOptions(setting).shade, nullptr, 6, {});
    EXPECT_EQ(exactness.pictures.size(), 6u);
    for (const Check& check : exactness.checks)
      EXPECT_EQ(check.verdict, Verdict::kept) << kind << " " << check.finding;
  }
}

TEST_F(VerifySphere, SurfelsOutsideOfAMatteAreNotComparedWithIt) {
  model::Model frayed = model::openModel(model().folder);
  for (size_t i = 0; i < frayed.cloud.size(); i += 10)
    frayed.cloud.p0[i] = assume<Point3<AcquisitionSpace>>(1.5f * frayed.cloud.p0[i].raw());
  surfels::SurfelRenderer renderer(std::make_shared<model::Model>(model::openModel(model().folder)), {});
  const auto checks = exactnessOf(frayed, renderer, {}, nullptr, 1, {}).checks;
  const Check& check = checkOf(checks, "exact_surfels");
  EXPECT_EQ(check.verdict, Verdict::kept) << check.finding;
  EXPECT_NE(check.finding.find("outside of the mattes"), std::string::npos) << check.finding;
}

TEST_F(VerifySphere, AHalfThatIsMirroredIsFoldedOver) {
  // |x|: every surfel with x < 0 is turned inside out.
  const auto folded = std::ranges::count_if(model().cloud.p0, [](const auto& p) { return p.x() < -0.001f; });
  const FrameFindings findings = findingsOf(*expression("abs(x) + 0.001*x", "y", "z"));
  const Check& check = checkOf(findings.checks, "folded");
  EXPECT_EQ(check.verdict, Verdict::broken);
  const double share = 100 * static_cast<double>(folded) / static_cast<double>(model().cloud.size());
  EXPECT_NEAR(std::min(share, 100 - share), check.figure, 0.5);
  ASSERT_FALSE(check.places.empty());
}

TEST_F(VerifySphere, AMirrorOfEverythingIsNoFold) {
  const FrameFindings findings = findingsOf(*warp::scaleWarp({-1, 1, 1}, {0, 0, 0}));
  EXPECT_EQ(checkOf(findings.checks, "folded").verdict, Verdict::kept);
}

TEST_F(VerifySphere, TheSurfelWithoutAPlaceIsNamed) {
  const auto& p = model().cloud.p0[777];
  // Not a number within 1e-6 of this surfel alone.
  const std::string near = "(abs(x - " + std::to_string(p.x()) + ") + abs(y - " + std::to_string(p.y()) +
                           ") < 1e-5 ? sqrt(-1 - x^2) : x)";
  const FrameFindings findings = findingsOf(*expression(near, "y", "z"));
  const Check& check = checkOf(findings.checks, "collapsed");
  EXPECT_EQ(check.verdict, Verdict::broken);
  ASSERT_EQ(check.places.size(), 1u);
  EXPECT_EQ(check.places[0].surfel, 777u);
}

TEST_F(VerifySphere, ABoundOfTheUserDecides) {
  const auto wide = warp::scaleWarp({1, 1, 3}, {0, 0, 0});
  const FrameFindings findings = findingsOf(*wide, {{"stretch", 2}});
  EXPECT_EQ(checkOf(findings.checks, "stretch").verdict, Verdict::broken);
  EXPECT_EQ(checkOf(findingsOf(*wide).checks, "stretch").verdict, Verdict::kept);
  EXPECT_THROW(requireBounds({{"strech", 2}}), Error);
}

TEST_F(VerifySphere, SurfelsWithoutACameraAreCounted) {
  model::Model blind = model::openModel(model().folder);
  const size_t hidden = blind.cloud.size() / 10;
  std::fill_n(blind.visibility.values.begin(), hidden * blind.visibility.views, uint8_t{0});
  const auto checks = modelChecks(blind, {}, {});
  const Check& coverage = checkOf(checks, "coverage");
  EXPECT_EQ(coverage.verdict, Verdict::broken);
  EXPECT_NEAR(coverage.figure, 10, 1);
}

TEST_F(VerifySphere, LightFromWhereNoneWasCapturedIsFlagged) {
  model::Model oneSided = model::openModel(model().folder);
  surfels::FrameWorkspace workspace(oneSided, size_t{1} << 26);
  // Captured lights keep their places; those near the script's light are moved to the other side.
  for (capture::Light& light : oneSided.rig.lights) {
    auto& directional = std::get<capture::DirectionalLight>(light.kind);
    if (directional.towards.raw().dot(Vec3<double>(0.6, 0, 0.8)) > 0)
      directional.towards = -directional.towards;
  }
  const auto warp = studio::noWarp();
  const FrameFindings findings = frameChecks(oneSided, {*warp, camera, lights}, {}, workspace, {});
  const Check& check = checkOf(findings.checks, "lights_extrapolated");
  EXPECT_EQ(check.verdict, Verdict::broken);
  EXPECT_NEAR(check.figure, 100, 1e-9);
}

TEST(VerifyBlocks, ErrorsAreMeasuredAndDamageIsFound) {
  const PackedStudio packed({.cameras = 5, .lights = 4, .size = pictureSize}, 800);
  const auto good = blockChecks(packed.model, &packed.capture, {});
  EXPECT_EQ(checkOf(good, "blocks_damaged").verdict, Verdict::kept);
  const Check& error = checkOf(good, "block_error");
  EXPECT_EQ(error.verdict, Verdict::kept);
  EXPECT_GT(error.figure, 0.3); // the encoder uses what it is allowed
  EXPECT_EQ(checkOf(blockChecks(packed.model, nullptr, {}), "block_error").verdict, Verdict::inapplicable);

  // A flipped byte in the last block of a file.
  const auto path = packed.model.files[2].path();
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekg(-3, std::ios::end);
  const auto byte = static_cast<char>(file.get() ^ 0x40);
  file.seekp(-3, std::ios::end);
  file.put(byte);
  file.close();
  EXPECT_EQ(checkOf(blockChecks(model::openModel(packed.model.folder), nullptr, {}), "blocks_damaged").figure,
            1);
}

TEST(VerifyBlocks, TheOrderOfFramesInTheCaptureDoesNotMatter) {
  const PackedStudio packed({.cameras = 5, .lights = 4, .size = pictureSize}, 800);
  capture::Capture reversed = packed.capture;
  std::ranges::reverse(reversed.frames);
  EXPECT_EQ(checkOf(blockChecks(packed.model, &reversed, {}), "block_error").figure,
            checkOf(blockChecks(packed.model, &packed.capture, {}), "block_error").figure);
  surfels::SurfelRenderer renderer(std::make_shared<model::Model>(model::openModel(packed.model.folder)), {});
  EXPECT_EQ(exactnessOf(packed.model, renderer, {}, &reversed, 7, {}).pictures.size(), 7u);
}

TEST(VerifyBlocks, AnotherCaptureIsRefused) {
  const PackedStudio packed({.cameras = 5, .lights = 4, .size = pictureSize}, 800);
  const PackedStudio other({.cameras = 5, .lights = 3, .size = pictureSize}, 800);
  EXPECT_THROW(blockChecks(packed.model, &other.capture, {}), Error);
}

TEST(VerifyFixedLight, WhatNeedsLightsDoesNotApply) {
  const PackedStudio packed({.cameras = 8, .lights = 0, .size = pictureSize}, 1500);
  const auto checks = modelChecks(packed.model, {}, {});
  EXPECT_EQ(checkOf(checks, "light_gap").verdict, Verdict::inapplicable);
  EXPECT_EQ(checkOf(checks, "weights").verdict, Verdict::kept);
  surfels::FrameWorkspace workspace(packed.model, size_t{1} << 26);
  const auto warp = studio::noWarp();
  const auto findings = frameChecks(
      packed.model, {*warp, cameraFrom<ObjectSpace>({0.3, 0.5, 1}, pictureSize), {}}, {}, workspace, {});
  EXPECT_EQ(checkOf(findings.checks, "lights_extrapolated").verdict, Verdict::inapplicable);
  EXPECT_EQ(countBroken(findings.checks), 0u);
}

} // namespace
} // namespace surflect::verify
