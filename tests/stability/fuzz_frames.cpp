// Frames of tiny models under random extreme warps, lights, cameras and options: no value of a pixel is not a
// number, weights sum to 1, and what the warp breaks is flagged.
//
//   fuzz_frames COUNT [FIRST]   frames of the seeds FIRST (default 0) to FIRST + COUNT - 1
//
// Exits with 1 at the first frame that fails; `fuzz_frames 1 SEED` repeats it alone.

#include "render/scene/script.h"
#include "render/verify/frame_checks.h"
#include "tests/render/films.h"
#include "tests/stability/dice.h"
#include "tests/stability/seeds.h"

#include <cmath>
#include <cstdio>
#include <limits>
#include <string>

namespace surflect::stability {
namespace {

constexpr int kSize = 20; // of pictures, pixels

warp::WarpPointer formulas(const std::string& x, const std::string& y, const std::string& z) {
  return warp::expressionWarp(warp::Expression(x, warp::warpVariables),
                              warp::Expression(y, warp::warpVariables),
                              warp::Expression(z, warp::warpVariables), {});
}

warp::WarpPointer randomWarp(Dice& dice) {
  const Vec3<double> axis = dice.unit(), center = dice.within(0, 2) * dice.unit();
  switch (dice.below(10)) {
  case 0:
    return warp::rigidWarp(axis, Angle::fromRadians(dice.within(-9, 9)), center,
                           dice.scale(1e-3, 1e6) * dice.unit());
  case 1: {
    Vec3<double> factors(dice.scale(1e-4, 1e4), dice.scale(1e-4, 1e4), dice.scale(1e-4, 1e4));
    if (dice.isRare()) factors[dice.below(3)] = 0;
    if (dice.isRare()) factors[dice.below(3)] *= -1;
    return warp::scaleWarp(factors, center);
  }
  case 2:
    return warp::twistWarp(axis, Angle::fromRadians(dice.scale(1e-3, 1e3)), center);
  case 3:
    return warp::bendWarp(axis, axis.unitOrthogonal(), Angle::fromRadians(dice.scale(1e-3, 100)), center);
  case 4:
    return warp::taperWarp(axis, dice.within(-20, 20), center);
  case 5:
    return warp::sineWarp({axis, dice.unit(), center, dice.scale(1e-3, 10), dice.scale(1e-3, 10),
                           Angle::fromRadians(dice.within(0, 6))});
  case 6:
    return formulas("abs(x)", "y", "z"); // folded over
  case 7:
    return formulas("x", "x > 0.3 ? sqrt(-1 - x^2) : y", "z"); // not a number in a part
  case 8:
    return formulas("x", "y", "1 / z"); // torn apart
  default:
    return formulas("exp(40*x)", "y*exp(40*x)", "z"); // beyond floats in a part
  }
}

scene::ShotLight randomLight(Dice& dice, const model::Model& model) {
  const auto strength = [&] { return dice.isRare() ? 0.f : static_cast<float>(dice.scale(1e-6, 1e6)); };
  const Rgb color{strength(), strength(), strength()};
  const auto extrapolation =
      dice.below(2) ? weights::LightExtrapolation::clamp : weights::LightExtrapolation::fade;
  const auto point = [&](const Vec3<double>& p) {
    return scene::ShotPointLight{assume<Point3<ObjectSpace, double>>(p), color, extrapolation};
  };
  switch (dice.below(5)) {
  case 0:
    return point(dice.scale(1e-4, 1e4) * dice.unit());
  case 1:
    return point(model.cloud.p0[static_cast<size_t>(dice.below(static_cast<int>(model.cloud.size())))]
                     .raw()
                     .cast<double>());
  case 2: {
    image::Image map(8, 4, 3);
    for (float& value : map.values) value = strength();
    if (dice.isRare()) map.values[7] = std::numeric_limits<float>::quiet_NaN();
    scene::ShotEnvironment environment;
    environment.map = std::make_shared<weights::EnvironmentMap>(
        weights::environmentOf(map, weights::EnvironmentMapping::latLong));
    environment.error = 0.2;
    environment.extrapolation = extrapolation;
    return environment;
  }
  default:
    return scene::ShotDirectionalLight{assume<Direction3<ObjectSpace, double>>(dice.unit()), color,
                                       extrapolation};
  }
}

surfels::FrameOptions randomOptions(Dice& dice, const model::Model& model) {
  surfels::FrameOptions options;
  constexpr weights::Interpolation kinds[] = {weights::Interpolation::paper, weights::Interpolation::separate,
                                              weights::Interpolation::kriging};
  options.shade.interpolation = kinds[dice.below(3)];
  options.shade.cameras = static_cast<size_t>(1 + dice.below(16));
  options.shade.pairs = static_cast<size_t>(1 + dice.below(16));
  if (dice.below(2)) options.shade.lights = static_cast<size_t>(1 + dice.below(16));
  if (model.isFullProduct && dice.below(2)) options.shade.lightFit = weights::LightFit::plane;
  options.shade.nearest = dice.isRare();
  options.splats.lowPass = dice.isRare() ? dice.scale(0.1, 5) : 0.44;
  if (dice.isRare()) options.surfelSize = dice.scale(0.1, 10);
  if (dice.isRare()) options.surfelsPerQuery = static_cast<size_t>(1 + dice.below(30));
  options.aovs.assign(scene::aovNames.begin(), scene::aovNames.end());
  if (model.grid) std::erase(options.aovs, "predicted_error");
  return options;
}

// Frames with a visible surfel, and with some that are flagged.
struct Tally {
  unsigned shown = 0, collapsed = 0, folded = 0, extrapolated = 0;
};

std::string complaint(const model::Model& model, unsigned seed, Tally& tally) {
  Dice dice(seed);
  std::vector<warp::WarpPointer> links;
  for (int i = dice.below(3); i >= 0; --i) links.push_back(randomWarp(dice));
  const warp::WarpPointer warp = warp::chainWarp(std::move(links));
  std::vector<scene::ShotLight> lights;
  if (!model.rig.lights.empty())
    for (int i = dice.below(3); i >= 0; --i) lights.push_back(randomLight(dice, model));
  const auto& aim = model.cloud.p0[static_cast<size_t>(dice.below(static_cast<int>(model.cloud.size())))];
  Vec3<double> place = warp->position(aim.raw().cast<double>());
  if (!place.allFinite() || place.norm() > 1e9) place = Vec3<double>::Zero();
  const scene::Scene scene{*warp, randomCamera(dice, place, kSize), lights};
  const surfels::FrameOptions options = randomOptions(dice, model);

  surfels::FrameWorkspace workspace(model, size_t{1} << 24);
  const surfels::FrameLayers film = surfels::renderFrame(model, scene, options, workspace);
  for (size_t i = 0; i < film.color.values.size(); ++i) {
    const float value = film.color.values[i];
    if (!std::isfinite(value)) return "a pixel is not finite";
    if (i % 4 == 3 && !(value >= 0 && value <= 1.0001f)) return "alpha is " + std::to_string(value);
  }
  for (const auto& [name, aov] : film.aovs)
    for (const float value : aov.values)
      if (std::isnan(value) || (std::isinf(value) && name != "depth"))
        return name + " has a value that is not finite";

  const auto findings = verify::frameChecks(model, scene, options, workspace, {});
  for (const verify::Check& check : findings.checks)
    if (check.verdict == verify::Verdict::broken &&
        (check.rule->name == "frame_weights" || check.rule->name == "finite"))
      return std::string(check.rule->name) + ": " + check.finding;

  tally.shown += !workspace.raster.visible.empty();
  for (const verify::Check& check : findings.checks) {
    if (check.verdict != verify::Verdict::broken) continue;
    tally.collapsed += check.rule->name == "collapsed";
    tally.folded += check.rule->name == "folded";
    tally.extrapolated += check.rule->name == "views_extrapolated";
  }

  // A surfel without a place in single precision must be dead, and the check must count all that are.
  const DeformedCloud& cloud = workspace.deformed;
  size_t dead = 0;
  for (size_t i = 0; i < model.cloud.size(); ++i) {
    const bool isDead = cloud.handedness[i] == Handedness::dead;
    dead += isDead;
    const Vec3<double> p = warp->position(model.cloud.p0[i].raw().cast<double>());
    if (!p.cast<float>().allFinite() && !isDead)
      return "surfel " + std::to_string(i) + " has no place and no flag";
    if (!cloud.p[i].raw().allFinite() || !cloud.u[i].raw().allFinite())
      return "a warped surfel is not finite";
  }
  for (const verify::Check& check : findings.checks)
    if (check.rule->name == "collapsed" && (check.verdict == verify::Verdict::broken) != (dead > 0))
      return "collapsed: " + check.finding + ", but " + std::to_string(dead) + " are dead";
  return "";
}

int run(unsigned count, unsigned first) {
  const studio::PackedStudio full({.cameras = 5, .lights = 6, .size = 24}, 300),
      gappy({.cameras = 6,
             .lights = 6,
             .size = 24,
             .split =
                 [](size_t view, size_t light) {
                   return (view + 2 * light) % 3 == 0 ? std::nullopt : std::optional(capture::Split::train);
                 }},
            300),
      fixed({.cameras = 5, .lights = 0, .size = 24}, 300);
  const image::TemporaryFolder folder;
  const studio::Studio oneView{.cameras = 1, .lights = 6, .size = 24};
  model::pack(studio::photographWithoutMesh(oneView, folder / "capture"), folder / "model",
              studio::packOptions(400), {}, nullptr);
  const model::Model grid = model::openModel(folder / "model");
  const model::Model* const models[] = {&full.model, &gappy.model, &fixed.model, &grid};
  Tally tally;
  for (unsigned seed = first; seed < first + count; ++seed)
    if (const std::string problem = complaint(*models[seed % 4], seed, tally); !problem.empty()) {
      std::fprintf(stderr, "frame %u: %s\n", seed, problem.c_str());
      return 1;
    }
  std::printf(
      "%u frames: %u show the object, %u have collapsed surfels, %u are folded over, %u are extrapolated\n",
      count, tally.shown, tally.collapsed, tally.folded, tally.extrapolated);
  return 0;
}

} // namespace
} // namespace surflect::stability

int main(int argc, char** argv) {
  return surflect::stability::runSeeds(argc, argv, surflect::stability::run);
}
