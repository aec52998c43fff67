// Frames that take over stages of the last one, against frames of a workspace of their own.
#include "render/surfels/kept_stages.h"

#include "render/surfels/frame.h"
#include "tests/render/films.h"
#include "tests/srf/shading/queries.h"

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <atomic>
#include <functional>
#include <random>

namespace surflect::surfels {
namespace {

using studio::cameraFrom;
using studio::pictureSize;

// What changes from one picture of a session to the next.
class SessionState {
public:
  SessionState(uint32_t seed, std::vector<FrameOptions> settings, bool hasEnvironment)
      : random_(seed), settings_(std::move(settings)) {
    lights = {point(), point(), scene::ShotDirectionalLight{direction(), {1, 2, 3}}};
    if (hasEnvironment) lights.push_back(environment());
    options = settings_.front();
    bend();
  }

  std::vector<scene::ShotLight> lights;
  capture::Camera<ObjectSpace> camera = cameraFrom<ObjectSpace>({1, 0.4, 0.3}, pictureSize);
  warp::WarpPointer warp;
  FrameOptions options;

  scene::Scene scene() const { return {*warp, camera, lights}; }

  // Lamps are dragged most often.
  void change() {
    switch (any(12)) {
    case 0:
      camera = cameraFrom<ObjectSpace>(direction().raw(), camera.lens.width);
      break;
    case 1:
      bend();
      break;
    case 2:
      options = settings_[any(settings_.size())];
      break;
    case 3:
      camera = cameraFrom<ObjectSpace>({1, 0.4, 0.3}, any(2) == 0 ? pictureSize : pictureSize + 17);
      break;
    case 4:
      break; // asked again
    case 5:
      if (auto* light = std::get_if<scene::ShotPointLight>(&lights[0])) light->intensity.g += 1;
      break;
    case 6:
      options.aovs =
          any(2) == 0 ? std::vector<std::string>{"normal", "light_blend"} : std::vector<std::string>{"depth"};
      break;
    case 7:
      if (lights.size() < 5)
        lights.insert(lights.begin(), point());
      else
        lights.erase(lights.begin());
      break;
    default:
      lights[any(2)] =
          any(5) == 0 ? scene::ShotLight(scene::ShotDirectionalLight{direction(), {2, 2, 1}}) : point();
    }
  }

  size_t any(size_t below) { return std::uniform_int_distribution<size_t>(0, below - 1)(random_); }

private:
  double uniform() { return std::uniform_real_distribution<double>(-1, 1)(random_); }
  Direction3<ObjectSpace, double> direction() {
    const double x = uniform(), y = uniform(), z = uniform();
    return normalized(Direction3<ObjectSpace, double>(x, y, z));
  }
  scene::ShotLight point() {
    const Direction3<ObjectSpace, double> towards = direction();
    return scene::ShotPointLight{{3 * towards.x(), 3 * towards.y(), 3 * towards.z()}, {9, 8, 7}};
  }
  static scene::ShotLight environment() {
    image::Image picture(8, 4, 3);
    for (size_t i = 0; i < picture.values.size(); ++i) picture.values[i] = static_cast<float>(i % 7);
    static const auto map = std::make_shared<const weights::EnvironmentMap>(
        weights::environmentOf(picture, weights::EnvironmentMapping::latLong));
    return scene::ShotEnvironment{map, Rotation<ObjectSpace, EnvironmentSpace>()};
  }
  // Waves that shadow one another.
  void bend() {
    const double phase = uniform();
    warp = warp::sineWarp({.axis = {0, 1, 0},
                           .direction = {1, 0, 0},
                           .center = {0, 0, 0},
                           .amplitude = 0.3,
                           .wavelength = 0.7,
                           .phase = Angle::fromRadians(phase)});
  }

  std::mt19937 random_;
  std::vector<FrameOptions> settings_;
};

// Renders the states of a session in a workspace that keeps stages, some of them not to the end, and expects
// the bits of new workspaces. Returns how many plans and answers were taken over.
struct TakenOver {
  size_t plans = 0, answers = 0;
};
TakenOver expectBitsOfNewWorkspaces(const model::Model& model, SessionState& state, int steps) {
  FrameWorkspace workspace(model, size_t{1} << 28);
  workspace.keepsStages = true;
  TakenOver taken;
  for (int step = 0; step < steps; ++step) {
    state.change();
    const scene::Scene scene = state.scene();
    tbb::task_arena(1 + step % 2).execute([&] {
      if (state.any(6) == 0) blendedAt(model, scene, {20.5, 20.5}, state.options, workspace);
      if (state.any(6) == 0) {
        std::atomic<int> left = static_cast<int>(state.any(60));
        Progress progress;
        progress.cancelled = [&] { return left-- <= 0; };
        try {
          renderFrame(model, scene, state.options, workspace, progress);
        } catch (const Cancelled&) {
        }
      }
      const bool hadPlans = workspace.kept.plans.areComplete;
      const FrameLayers film = renderFrame(model, scene, state.options, workspace);
      FrameWorkspace own(model, size_t{1} << 28);
      const FrameLayers expected = renderFrame(model, scene, state.options, own);
      EXPECT_EQ(film.color.values, expected.color.values) << step;
      for (const auto& [name, image] : expected.aovs)
        EXPECT_EQ(film.aovs.at(name).values, image.values) << step << ' ' << name;
      EXPECT_EQ(workspace.stats.visible, own.stats.visible);
      EXPECT_EQ(workspace.stats.splats.drawn, own.stats.splats.drawn);
      EXPECT_EQ(workspace.stats.unseen, own.stats.unseen);
      EXPECT_EQ(workspace.stats.unmatchedShadows, own.stats.unmatchedShadows);
      taken.plans += hadPlans && workspace.kept.plans.areComplete;
      taken.answers += workspace.stats.shading.operations < own.stats.shading.operations;
    });
  }
  return taken;
}

FrameOptions with(weights::Interpolation interpolation,
                  const std::function<void(FrameOptions&)>& change = {}) {
  FrameOptions options;
  options.shade.interpolation = interpolation;
  if (change) change(options);
  return options;
}

using KeptStagesOfSphere = studio::PackedSphere<2500>;

TEST_F(KeptStagesOfSphere, SeparateWeightsHaveTheBitsOfANewWorkspace) {
  using enum weights::Interpolation;
  const std::vector<FrameOptions> settings{
      with(separate), with(separate, [](FrameOptions& o) { o.surfelSize = 3; }),
      with(paper, [](FrameOptions& o) { o.surfelsPerQuery = 4; }),
      with(separate, [](FrameOptions& o) { o.tangents = Tangents::bisector, o.shade.targetsAtOnce = 700; })};
  for (const bool hasEnvironment : {false, true}) {
    SessionState state(hasEnvironment ? 1 : 2, settings, hasEnvironment);
    EXPECT_GT(expectBitsOfNewWorkspaces(model(), state, hasEnvironment ? 20 : 40).plans,
              hasEnvironment ? 2u : 5u);
  }
}

TEST_F(KeptStagesOfSphere, KrigingHasTheBitsOfANewWorkspace) {
  using enum weights::Interpolation;
  const auto shadowed = [](bool shadows, double surfelSize, std::optional<size_t> perQuery) {
    return with(kriging, [=](FrameOptions& o) {
      o.shadows = shadows, o.surfelSize = surfelSize, o.surfelsPerQuery = perQuery;
    });
  };
  ASSERT_TRUE(castsShadows(model(), shadowed(true, 0, {}).shade, true));
  SessionState state(3,
                     {shadowed(true, 0, {}), shadowed(true, 0, 16), shadowed(false, 0, {}),
                      shadowed(true, 3, {}), shadowed(true, 0, 1), with(separate)},
                     false);
  EXPECT_GT(expectBitsOfNewWorkspaces(model(), state, 60).answers, 8u);
  SessionState lit(4, {shadowed(true, 0, {})}, true);
  expectBitsOfNewWorkspaces(model(), lit, 10);
}

TEST(KeptStagesOfTranslucentSphere, HaveTheBitsOfANewWorkspace) {
  const studio::PackedStudio packed(studio::Studio{.size = pictureSize, .opacity = 0.6f}, 2000);
  using enum weights::Interpolation;
  SessionState state(5, {with(separate), with(kriging)}, false);
  expectBitsOfNewWorkspaces(packed.model, state, 30);
}

using KeptStagesWithTables = studio::TableQueries;

TEST_F(KeptStagesWithTables, HaveTheBitsOfANewWorkspace) {
  using enum weights::Interpolation;
  for (const weights::Interpolation otherwise : {kriging, separate}) {
    model.interpolation.otherwise = otherwise;
    SessionState state(
        6, {with(shared), with(shared, [](FrameOptions& o) { o.surfelsPerQuery = 16; }), with(kriging)},
        false);
    const TakenOver taken = expectBitsOfNewWorkspaces(model, state, 40);
    if (otherwise == kriging) EXPECT_GT(taken.answers, 4u);
  }
}

// A lamp that moves alone asks for its own weights, and for those of the others where its shadow moves.
TEST_F(KeptStagesOfSphere, ALampThatMovesAloneAsksForFewLookUps) {
  FrameWorkspace workspace(model(), size_t{1} << 28);
  workspace.keepsStages = true;
  const FrameOptions options = with(weights::Interpolation::kriging);
  SessionState state(7, {options}, false);
  renderFrame(model(), state.scene(), options, workspace);
  const auto all = static_cast<double>(workspace.stats.shading.operations);
  auto& lamp = std::get<scene::ShotPointLight>(state.lights[0]);
  lamp.position = lamp.position + Direction3<ObjectSpace, double>(0.05, 0, 0);
  renderFrame(model(), state.scene(), options, workspace);
  EXPECT_LT(static_cast<double>(workspace.stats.shading.operations), 0.6 * all);
}

// What was kept for one way to weight photographs makes room for the other.
TEST_F(KeptStagesOfSphere, OnlyOneWayToWeightPhotographsIsKept) {
  FrameWorkspace workspace(model(), size_t{1} << 28);
  workspace.keepsStages = true;
  FrameOptions byPairs = with(weights::Interpolation::kriging),
               apart = with(weights::Interpolation::separate);
  byPairs.shadows = true;
  SessionState state(8, {byPairs}, false);
  const auto render = [&](const FrameOptions& options, int times) {
    for (int i = 0; i < times; ++i) {
      state.camera = cameraFrom<ObjectSpace>({1, 0.4, 0.3 + 0.01 * i}, pictureSize);
      renderFrame(model(), state.scene(), options, workspace);
    }
  };
  render(byPairs, 2);
  EXPECT_FALSE(workspace.kept.answers.isEmpty());
  EXPECT_FALSE(workspace.kept.shadows.isEmpty());
  render(apart, 2);
  EXPECT_TRUE(workspace.kept.answers.isEmpty());
  EXPECT_TRUE(workspace.kept.shadows.isEmpty());
  EXPECT_FALSE(workspace.kept.occluders);
  EXPECT_FALSE(workspace.kept.lookUps.isEmpty());
  render(byPairs, 1);
  EXPECT_TRUE(workspace.kept.lookUps.isEmpty());
  EXPECT_TRUE(workspace.kept.plans.plans.empty());
}

// Lamps that stay say nothing while every surfel turns under them.
TEST_F(KeptStagesOfSphere, WhileTheWarpMovesNothingIsKeptThatTheNextFrameCannotUse) {
  for (const auto interpolation : {weights::Interpolation::kriging, weights::Interpolation::separate}) {
    FrameWorkspace workspace(model(), size_t{1} << 28);
    workspace.keepsStages = true;
    FrameOptions options = with(interpolation);
    options.shadows = true;
    SessionState state(9, {options}, false);
    for (int frame = 0; frame < 3; ++frame) {
      state.warp = warp::sineWarp({.axis = {0, 1, 0},
                                   .direction = {1, 0, 0},
                                   .center = {0, 0, 0},
                                   .amplitude = 0.3,
                                   .wavelength = 0.7,
                                   .phase = Angle::fromRadians(frame)});
      renderFrame(model(), state.scene(), options, workspace);
      EXPECT_TRUE(workspace.kept.shadows.isEmpty());
      EXPECT_TRUE(workspace.kept.lookUps.isEmpty());
    }
    state.camera = cameraFrom<ObjectSpace>({1, 0.5, 0.3}, pictureSize);
    renderFrame(model(), state.scene(), options, workspace);
    const bool isKriging = interpolation == weights::Interpolation::kriging;
    EXPECT_EQ(workspace.kept.shadows.isEmpty(), !isKriging);
    EXPECT_EQ(workspace.kept.lookUps.isEmpty(), isKriging);
  }
}

TEST_F(KeptStagesOfSphere, AnOrdinaryFrameKeepsNoOccluders) {
  FrameWorkspace workspace(model(), size_t{1} << 28);
  FrameOptions options = with(weights::Interpolation::kriging);
  options.shadows = true;
  SessionState state(10, {options}, false);
  renderFrame(model(), state.scene(), options, workspace);
  EXPECT_GT(workspace.stats.occluders, 0u);
  EXPECT_FALSE(workspace.kept.occluders);
}

// A camera that moves a little finds most look-ups of the last frame.
TEST_F(KeptStagesOfSphere, ACameraThatMovesAloneLooksLittleUp) {
  FrameWorkspace workspace(model(), size_t{1} << 28);
  workspace.keepsStages = true;
  const FrameOptions options = with(weights::Interpolation::separate);
  SessionState state(11, {options}, false);
  std::vector<double> lookups;
  for (int frame = 0; frame < 3; ++frame) {
    state.camera = cameraFrom<ObjectSpace>({1, 0.4, 0.3 + 0.002 * frame}, pictureSize);
    renderFrame(model(), state.scene(), options, workspace);
    lookups.push_back(static_cast<double>(workspace.stats.shading.lookups));
  }
  EXPECT_LT(lookups[2], 0.5 * lookups[0]);
}

// Lights that come, go and change places keep the states of those that stay.
TEST(KeptShadows, KeepTheStatesOfLightsThatStay) {
  DeformedCloud deformed;
  deformed.p = {Point3<ObjectSpace>{0, 0, 0}, Point3<ObjectSpace>{1, 0, 0}};
  deformed.u = {Direction3<ObjectSpace>{1, 0, 0}, Direction3<ObjectSpace>{1, 0, 0}};
  deformed.v = {Direction3<ObjectSpace>{0, 1, 0}, Direction3<ObjectSpace>{0, 1, 0}};
  deformed.handedness.assign(2, Handedness::kept);
  const ShadowLight a{false, {0, 0, 1}}, b{false, {0, 1, 1}}, c{true, {0, 0, 1}};
  KeptShadows kept;
  kept.arrange(std::array{a, b}, 2);
  for (uint32_t surfel : {0, 1}) {
    kept.pose(surfel, deformed, surfel);
    EXPECT_TRUE(std::isnan(kept.stateAt(surfel, 0)));
    kept.stateAt(surfel, 0) = 0.25f;
    kept.stateAt(surfel, 1) = 0.5f + static_cast<float>(surfel);
  }
  kept.arrange(std::array{b, c, b}, 2);
  kept.pose(1, deformed, 1);
  EXPECT_EQ(kept.stateAt(1, 0), 1.5f);
  EXPECT_TRUE(std::isnan(kept.stateAt(1, 1)));
  EXPECT_TRUE(std::isnan(kept.stateAt(1, 2)));
  deformed.p[0] = {0, 0, 0.1f};
  kept.pose(0, deformed, 0);
  EXPECT_TRUE(std::isnan(kept.stateAt(0, 0)));
  kept.forget();
  EXPECT_TRUE(kept.isEmpty());
  kept.arrange(std::array{b}, 2);
  kept.pose(1, deformed, 1);
  EXPECT_TRUE(std::isnan(kept.stateAt(1, 0)));
}

} // namespace
} // namespace surflect::surfels
