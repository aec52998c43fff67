// Frames of tiny light fields by all their renderers, from random extreme cameras and with random knobs: no
// value of a pixel is not a number, equal scenes have equal bits, pictures are those of the plain forms in
// double precision, weights sum to 1, and what a renderer refuses leaves it as it was.
//
//   fuzz_light_fields COUNT [FIRST]   frames of the seeds FIRST (default 0) to FIRST + COUNT - 1
//
// Exits with 1 at the first frame that fails; `fuzz_light_fields 1 SEED` repeats it alone.

#include "render/gl/projection.h"
#include "render/lightfield/common/relight.h"
#include "srf/image/resize.h"
#include "surfel/base/error.h"
#include "surfel/math/bounds.h"
#include "tests/srf/image/files.h"
#include "tests/stability/dice.h"
#include "tests/stability/seeds.h"
#include "tests/stability/tiny_light_fields.h"
#include "warp/warp.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace surflect::stability {
namespace {

constexpr int kSize = 20; // of pictures, pixels

// Frames by what was asked of them.
struct Tally {
  unsigned shown = 0, refused = 0, compared = 0;
};

Vec3<double> nearestOnTriangle(const std::array<Vec3<double>, 3>& corners, const Vec3<double>& p) {
  const auto& [a, b, c] = corners;
  const Vec3<double> normal = (b - a).cross(c - a);
  const auto nearestOnEdge = [&](const Vec3<double>& from, const Vec3<double>& to) {
    const Vec3<double> along = to - from;
    const double squared = along.squaredNorm();
    return Vec3<double>(from +
                        (squared > 0 ? std::clamp((p - from).dot(along) / squared, 0., 1.) : 0) * along);
  };
  if (normal.squaredNorm() > 0) {
    const Vec3<double> foot = p - normal.dot(p - a) / normal.squaredNorm() * normal;
    const auto isInside = [&](const Vec3<double>& from, const Vec3<double>& to) {
      return normal.dot((to - from).cross(foot - from)) >= 0;
    };
    if (isInside(a, b) && isInside(b, c) && isInside(c, a)) return foot;
  }
  Vec3<double> nearest = nearestOnEdge(a, b);
  for (const Vec3<double>& other : {nearestOnEdge(b, c), nearestOnEdge(c, a)})
    if ((other - p).squaredNorm() < (nearest - p).squaredNorm()) nearest = other;
  return nearest;
}

double distanceTo(const TriangleMesh& mesh, const Vec3<double>& p) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& triangle : mesh.triangles) {
    std::array<Vec3<double>, 3> corners;
    for (size_t i = 0; i < 3; ++i) corners[i] = mesh.positions[triangle[i]].cast<double>().raw();
    least = std::min(least, (nearestOnTriangle(corners, p) - p).norm());
  }
  return least;
}

// Also cameras that stand exactly at a vertex or at a photograph, that look away, with pictures of a pixel or
// with an axis beside the picture, and lenses that OpenGL does not have.
capture::Camera<ObjectSpace> lightFieldCamera(Dice& dice, const Subject& subject) {
  const TriangleMesh& mesh = subject.mesh;
  const auto vertex = [&] {
    const auto any = static_cast<size_t>(dice.below(static_cast<int>(mesh.positions.size())));
    return Vec3<double>(mesh.positions[any].cast<double>().raw());
  };
  auto camera = randomCamera(dice, dice.below(2) ? vertex() : middleOf(mesh.positions).raw(), kSize);
  capture::Lens& lens = camera.lens;
  if (dice.isRare()) {
    const Mat3<double> rotation =
        dice.below(2) ? Mat3<double>(Mat3<double>::Identity()) : camera.cameraFromWorld.rotation();
    camera.cameraFromWorld = {rotation, -(rotation * vertex())};
  } else if (dice.isRare()) {
    const std::vector<capture::View>& views = subject.renderer->describe().rig.views;
    const auto& pose =
        views[static_cast<size_t>(dice.below(static_cast<int>(views.size())))].camera.cameraFromWorld;
    camera.cameraFromWorld = {pose.rotation(), pose.translation()};
  }
  if (dice.isRare()) {
    const Mat3<double> turned = Vec3<double>(-1, 1, -1).asDiagonal();
    const auto& pose = camera.cameraFromWorld;
    camera.cameraFromWorld = {turned * pose.rotation(), turned * pose.translation()};
  }
  if (dice.isRare()) {
    lens.width = 1 + dice.below(3);
    lens.height = dice.below(2) ? 1 : 1 + dice.below(40);
  }
  if (dice.isRare()) lens.centerX += dice.within(-30, 30);
  if (dice.isRare()) lens.focalY *= dice.scale(0.1, 10);
  if (lens.model == capture::Lens::Model::orthographic && dice.below(2)) {
    lens.model = capture::Lens::Model::pinhole;
    lens.k1 = 0.1;
  }
  return camera;
}

method::Setting randomSetting(Dice& dice, const Subject& subject) {
  method::Setting setting = subject.setting;
  for (const method::Option& knob : subject.renderer->options()) {
    if (knob.sweep.empty()) continue;
    const int value = dice.below(static_cast<int>(knob.sweep.size()));
    if (knob.name == "samples")
      setting["samples"] = dice.below(2) ? 1 : 1 + dice.below(3);
    else if (knob.name == "level" && dice.below(2))
      setting["level"] = dice.within(0, knob.sweep[0].number());
    else if (dice.below(2))
      setting[knob.name] = knob.sweep[static_cast<size_t>(value)];
  }
  return setting;
}

// A setting that no renderer takes, with values that it would take beside it.
method::Setting badSetting(Dice& dice, const Subject& subject) {
  method::Setting setting = randomSetting(dice, subject);
  const std::span<const method::Option> options = subject.renderer->options();
  const auto any = static_cast<size_t>(dice.below(static_cast<int>(options.size())));
  constexpr double kBad[] = {-1, 1e9, std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::infinity()};
  setting[dice.isRare() ? "no option" : options[any].name] = kBad[dice.below(4)];
  return setting;
}

// Complaint about values of a picture by themselves; empty if there is none.
std::string wrongValues(const method::FrameLayers& film, double brightest) {
  const auto& color = film.color.values;
  for (size_t i = 0; i < color.size(); ++i) {
    if (!std::isfinite(color[i])) return "a pixel is not finite";
    if (i % 4 == 3 ? !(color[i] >= 0 && color[i] <= 1.0001f) : color[i] < 0)
      return (i % 4 == 3 ? "alpha is " : "a channel is ") + std::to_string(color[i]);
    if (brightest > 0 && i % 4 != 3 && color[i] > 1.001 * brightest)
      return "a channel is " + std::to_string(color[i]) + ", brighter than the photographs";
  }
  for (const auto& [name, aov] : film.aovs)
    for (size_t i = 0; i < aov.values.size(); ++i) {
      const float value = aov.values[i];
      if (name == "depth" && !(value > 0 && std::isfinite(value) == (color[4 * i + 3] > 0)))
        return "depth is " + std::to_string(value) + " where alpha is " + std::to_string(color[4 * i + 3]);
      if (name == "observed" && !(value >= 0 && value <= 1.0001f))
        return "observed is " + std::to_string(value);
      if (name == "position" && !std::isfinite(value)) return "position is " + std::to_string(value);
    }
  return "";
}

// How far single precision and the steps of a rasteriser may move the object in a picture, in pixels;
// infinite where the near plane cuts it.
double shiftOf(const Subject& subject, const method::Setting& setting, const LightFieldCamera& camera) {
  const Eigen::AlignedBox3d box = boundsOf(subject.mesh.positions);
  Eigen::Isometry3d cameraFromWorld = Eigen::Isometry3d::Identity();
  cameraFromWorld.linear() = camera.cameraFromWorld.rotation();
  cameraFromWorld.translation() = camera.cameraFromWorld.translation();
  const gl::DepthRange range = gl::depthRangeOf(box.transformed(cameraFromWorld));
  const double distance = distanceTo(subject.mesh, camera.center().raw());
  const capture::Lens& lens = camera.lens;
  double longest = 1; // of rays that end one unit before the camera
  for (const double x : {0., 0. + lens.width})
    for (const double y : {0., 0. + lens.height})
      longest = std::max(
          longest,
          Vec3<double>((x - lens.centerX) / lens.focalX, (y - lens.centerY) / lens.focalY, 1).norm());
  const double nearest = distance / longest;
  if (subject.hasNearPlane(setting) && !(nearest > 1.01 * range.near))
    return std::numeric_limits<double>::infinity();
  const double focal = std::max(lens.focalX, lens.focalY);
  return 1. / 128 + 0x1p-21 * focal * box.diagonal().norm() / nearest;
}

// Whether a picture is that of the plain form: up to the tolerance, each pixel is what the plain form shows
// within `shift` of its middle. Empty if it is; none if it cannot be told.
std::optional<std::string> disagreement(const Subject& subject, const method::Setting& setting,
                                        const image::Image& shown, const LightFieldCamera& camera,
                                        int samples) {
  const auto plainAt = [&](double x, double y) {
    LightFieldCamera sampled = camera;
    sampled.lens = capture::resized(camera.lens, samples * camera.lens.width, samples * camera.lens.height);
    sampled.lens.centerX += x;
    sampled.lens.centerY += y;
    auto picture = subject.plain(sampled, setting);
    return picture ? std::optional(image::squareMeans(*picture, samples)) : std::nullopt;
  };
  const std::optional<image::Image> middle = plainAt(0, 0);
  if (!middle) return std::nullopt;
  image::Image low = *middle, high = *middle;
  const auto wrong = [&] {
    size_t count = 0;
    for (size_t i = 0; i < shown.values.size(); i += 4) {
      bool isWrong = false;
      for (size_t c = i; c < i + 4; ++c)
        isWrong |= !(shown.values[c] >= low.values[c] - subject.tolerance &&
                     shown.values[c] <= high.values[c] + subject.tolerance);
      count += isWrong;
    }
    return count;
  };
  if (wrong() == 0) return "";
  LightFieldCamera sampled = camera;
  sampled.lens = capture::resized(camera.lens, samples * camera.lens.width, samples * camera.lens.height);
  const double shift = shiftOf(subject, setting, sampled);
  if (!(shift < 0.5)) return std::nullopt;
  for (int i = 0; i < 16; ++i) {
    const double turn = std::numbers::pi * i / 4, reach = i < 8 ? shift : shift / 2;
    const auto moved = plainAt(reach * std::cos(turn), reach * std::sin(turn));
    for (size_t k = 0; k < low.values.size(); ++k) {
      low.values[k] = std::min(low.values[k], moved->values[k]);
      high.values[k] = std::max(high.values[k], moved->values[k]);
    }
  }
  const size_t left = wrong();
  if (left <= subject.gaps) return "";
  return std::to_string(left) + " of " + std::to_string(shown.values.size() / 4) +
         " pixels are not those of the plain form, at " + std::to_string(samples) + " samples";
}

// Weights of photographs under captured lights keep the irradiance of a light.
std::string wrongPhotographWeights(Dice& dice) {
  const std::vector<capture::Light> captured = studio::studioLights(2 + dice.below(8));
  const auto middle =
      assume<Point3<AcquisitionSpace, double>>(Vec3<double>(dice.within(0, 0.5) * dice.unit()));
  const Rgb color{static_cast<float>(dice.scale(1e-6, 1e6)), 1, static_cast<float>(dice.scale(1e-6, 1e6))};
  const Vec3<double> towards = dice.unit();
  const scene::ShotLight light = scene::ShotDirectionalLight{assume<Direction3<ObjectSpace, double>>(towards),
                                                             color, weights::LightExtrapolation::clamp};
  Rgb sum;
  const std::vector<Rgb> weights = lightfield::photographWeights(captured, middle, {&light, 1});
  for (size_t l = 0; l < weights.size(); ++l)
    sum = sum + weights[l] * capture::irradianceAt(captured[l], middle);
  const double error =
      std::max({std::abs(sum.r / color.r - 1), std::abs(sum.g / color.g - 1), std::abs(sum.b / color.b - 1)});
  return error <= 1e-4 ? ""
                       : "weights of photographs change a light's irradiance by " + std::to_string(error);
}

std::string complaint(const Subject& subject, unsigned seed, Tally& tally) {
  Dice dice(seed);
  method::Renderer& renderer = *subject.renderer;
  const warp::WarpPointer rest = warp::chainWarp({});
  const scene::Scene scene{*rest, lightFieldCamera(dice, subject), {}};
  const method::Setting setting = randomSetting(dice, subject);
  renderer.set(setting);
  const std::string identity = renderer.describe().identity;
  const std::vector<std::string> aovs{"depth", "observed", "position"};
  const capture::Lens& lens = scene.camera.lens;
  const bool isOrthographic = lens.model == capture::Lens::Model::orthographic;
  if (isOrthographic || lens.distorts()) {
    try {
      renderer.render(scene, aovs);
    } catch (const Error& error) {
      ++tally.refused;
      const char* reason = isOrthographic ? "orthographic" : "distort";
      return std::string(error.what()).find(reason) == std::string::npos ? error.what() : "";
    }
    return "a lens that OpenGL does not have is not refused";
  }
  const method::FrameLayers film = renderer.render(scene, aovs);
  if (std::string wrong = wrongValues(film, subject.brightest); !wrong.empty()) return wrong;
  const auto& values = film.color.values;
  bool isShown = false;
  for (size_t i = 3; i < values.size(); i += 4) isShown |= values[i] > 0;
  tally.shown += isShown;
  if (film.report.remark.has_value() == isShown)
    return "the remark is wrong on whether the object is visible";

  // Another frame, or what is refused, between two frames of one scene.
  if (dice.below(2)) {
    auto other = studio::cameraFrom<ObjectSpace>(dice.unit(), 4 + dice.below(8));
    renderer.set(randomSetting(dice, subject));
    renderer.render({*rest, other, {}});
    renderer.set(setting);
  } else {
    try {
      renderer.set(badSetting(dice, subject));
      return "a bad setting is not refused";
    } catch (const Error&) {
    }
  }
  if (renderer.describe().identity != identity) return "a refused setting changed the identity";
  const method::FrameLayers again = renderer.render(scene, aovs);
  if (again.color.values != values) return "a second frame of the scene has other bits";
  for (const auto& [name, aov] : film.aovs)
    if (again.aovs.at(name).values != aov.values) return "a second " + name + " has other bits";

  const auto& pose = scene.camera.cameraFromWorld;
  const LightFieldCamera camera{lens, {pose.rotation(), pose.translation()}};
  const int samples = static_cast<int>(setting.at("samples").number());
  const auto wrong = disagreement(subject, setting, film.color, camera, samples);
  if (wrong && !wrong->empty()) return *wrong;
  tally.compared += wrong.has_value();
  if (std::string weights = wrongPhotographWeights(dice); !weights.empty()) return weights;
  return subject.wrongWeights ? subject.wrongWeights(camera.center().raw(), dice) : "";
}

int run(unsigned count, unsigned first) {
  const image::TemporaryFolder folder;
  const std::vector<SubjectName> names = tinyLightFields(folder.path());
  std::vector<std::optional<Subject>> subjects(names.size());
  Tally tally;
  for (unsigned seed = first; seed < first + count; ++seed) {
    const size_t i = seed % names.size();
    std::string problem;
    try {
      if (!subjects[i]) subjects[i] = names[i].open();
      problem = complaint(*subjects[i], seed, tally);
    } catch (const std::exception& error) {
      problem = std::string("threw ") + error.what();
    }
    if (problem.empty()) continue;
    std::fprintf(stderr, "frame %u (%s): %s\n", seed, names[i].name.c_str(), problem.c_str());
    return 1;
  }
  std::printf(
      "%u frames by %zu renderers: %u show the object, %u cameras are refused, %u are as the plain form\n",
      count, names.size(), tally.shown, tally.refused, tally.compared);
  return 0;
}

} // namespace
} // namespace surflect::stability

int main(int argc, char** argv) {
  return surflect::stability::runSeeds(argc, argv, surflect::stability::run);
}
