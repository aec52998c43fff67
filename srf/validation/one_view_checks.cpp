// Light directions of one view, checked by the photographs alone [Woodham 1980]: a Lambert surface shows b =
// g . l, where l is the light's direction times its irradiance, and g the normal times albedo. Directions
// that are negated along some axes give a g that is negated along them too, which fits as well. But what a
// camera sees faces it, and turns outwards at the object's outline.
#include "srf/capture/photograph.h"
#include "srf/image/color.h"
#include "srf/validation/light_order.h"
#include "srf/validation/validation.h"
#include "surfel/base/text.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace surflect::validation {

namespace {

using Severity = Finding::Severity;
using World = AcquisitionSpace;

constexpr size_t kOneViewSamples = 6000, kFewestSamples = 50, kMostShots = 64;
constexpr size_t kOrderSamples = 1000, kLightsForOrder = 7;
constexpr std::ptrdiff_t kLitForOrder = 6; // photographs of a pixel, of which normal and albedo use 3
constexpr double kSolvable = 1e-3;         // as kWellPosed, where only the residual counts
constexpr double kUnshadowed = 0.05;       // of a pixel's brightest photograph; darker ones may be in shadow
constexpr double kLitObject = 0.1;     // of the brightest pixels, without a matte: the rest may be background
constexpr double kWellPosed = 0.05;    // smallest over largest eigenvalue of the lights' moments
constexpr double kMostTurned = 0.75;   // share of pixels; below 0.25 in correct captures
constexpr double kTurnedOutline = 0.3; // mean component of normals across the outline; less on flat objects
constexpr int kOutlineReach = 3;       // pixels
constexpr double kMuchSmaller = 0.6;   // residual of another order over that of the stated one

struct Sample {
  int x = 0, y = 0;
  std::vector<double> shown; // luminance by shot
  double brightest = 0;
};

std::vector<Sample> samplesOf(const capture::Lens& lens) {
  const double area = 1.0 * lens.width * lens.height;
  const int step = std::max(1, static_cast<int>(std::sqrt(area / kOneViewSamples)));
  std::vector<Sample> samples;
  for (int y = step / 2; y < lens.height; y += step)
    for (int x = step / 2; x < lens.width; x += step) samples.push_back({x, y, {}, 0});
  return samples;
}

// Normal times albedo by the photographs that light the pixel; none if they do not determine it.
std::optional<Vec3<double>> scaledNormal(const Sample& sample, std::span<const Vec3<double>> lights,
                                         double wellPosed = kWellPosed) {
  Mat3<double> moments = Mat3<double>::Zero();
  Vec3<double> right = Vec3<double>::Zero();
  for (size_t s = 0; s < lights.size(); ++s) {
    if (!(sample.shown[s] > kUnshadowed * sample.brightest)) continue;
    moments += lights[s] * lights[s].transpose();
    right += sample.shown[s] * lights[s];
  }
  const Eigen::SelfAdjointEigenSolver<Mat3<double>> solver(moments);
  if (!(solver.eigenvalues()[0] > wellPosed * solver.eigenvalues()[2])) return std::nullopt;
  const Vec3<double> g = moments.inverse() * right;
  return g.allFinite() && g.norm() > 0 ? std::optional(g) : std::nullopt;
}

// Relative residual of a Lambert fit, with a strength of each photograph's own: estimated strengths may hide
// wrong directions. Infinite if the lights do not determine normals.
double lambertResidual(std::span<const Sample> samples, std::vector<Vec3<double>> lights) {
  constexpr int kRounds = 3;
  double residual = 0, all = 0;
  for (int round = 0; round < kRounds; ++round) {
    residual = all = 0;
    std::vector<double> shownByFit(lights.size()), fitByFit(lights.size());
    for (const Sample& sample : samples) {
      const auto lit = std::ranges::count_if(
          sample.shown, [&](double shown) { return shown > kUnshadowed * sample.brightest; });
      const auto g = lit < kLitForOrder ? std::nullopt : scaledNormal(sample, lights, kSolvable);
      if (!g) continue;
      for (size_t s = 0; s < lights.size(); ++s) {
        if (!(sample.shown[s] > kUnshadowed * sample.brightest)) continue;
        const double fit = g->dot(lights[s]);
        residual += (sample.shown[s] - fit) * (sample.shown[s] - fit);
        all += sample.shown[s] * sample.shown[s];
        shownByFit[s] += sample.shown[s] * fit;
        fitByFit[s] += fit * fit;
      }
    }
    for (size_t s = 0; s < lights.size() && round + 1 < kRounds; ++s)
      if (shownByFit[s] > 0) lights[s] *= shownByFit[s] / fitByFit[s];
  }
  return all > 0 ? std::sqrt(residual / all) : std::numeric_limits<double>::infinity();
}

// Mistake in the order of the lights that fits the photographs much better than the stated order. `shots`:
// the light of each photograph.
std::optional<Finding> checkOrder(std::span<const Sample> samples, std::span<const Vec3<double>> lights,
                                  std::span<const size_t> shots, const capture::Capture& capture) {
  std::vector<std::optional<Vec3<double>>> ofLight(capture.lights.size());
  for (size_t s = 0; s < shots.size(); ++s) ofLight[shots[s]] = lights[s];
  double least = kMuchSmaller;
  std::optional<Finding> finding;
  for (const OrderMistake& mistake : orderMistakes(capture.lights)) {
    // Photographs whose light is known in either order.
    std::vector<size_t> known;
    std::vector<Vec3<double>> stated, other;
    for (size_t s = 0; s < shots.size(); ++s)
      if (const auto lit = mistake.lit[shots[s]]; lit && ofLight[*lit]) {
        known.push_back(s);
        stated.push_back(lights[s]);
        other.push_back(*ofLight[*lit]);
      }
    if (known.size() < kLightsForOrder) continue;
    std::vector<Sample> some;
    for (const size_t i : evenlySpaced(samples.size(), kOrderSamples)) {
      Sample& sample = some.emplace_back(Sample{samples[i].x, samples[i].y, {}, samples[i].brightest});
      for (const size_t s : known) sample.shown.push_back(samples[i].shown[s]);
    }
    const double asStated = lambertResidual(some, stated), fit = lambertResidual(some, other);
    if (!std::isfinite(asStated) || !(fit < least * asStated)) continue;
    least = fit / asStated;
    finding = {Severity::error,
               fmt::format(
                   "the table of lights looks {}: {} (a Lambert surface fits the photographs to {:.0f} %, "
                   "as the table is to {:.0f} %); {}",
                   mistake.what, describe(mistake, capture.lights), 100 * fit, 100 * asStated, mistake.cure)};
  }
  return finding;
}

// Unit direction from the object's inside to its outside, in the picture (x right, y up); none away from the
// outline.
std::optional<Vec2<double>> outwards(const image::Image& alpha, int x, int y) {
  Vec2<double> sum = Vec2<double>::Zero();
  for (int j = -kOutlineReach; j <= kOutlineReach; ++j)
    for (int i = -kOutlineReach; i <= kOutlineReach; ++i) {
      if (x + i < 0 || y + j < 0 || x + i >= alpha.width || y + j >= alpha.height) return std::nullopt;
      if (!(alpha.at(x + i, y + j)[0] > 0.5f)) sum += Vec2<double>(i, -j);
    }
  return sum.norm() > 0 ? std::optional<Vec2<double>>(sum.normalized()) : std::nullopt;
}

} // namespace

std::vector<Finding> checkLightsOfOneView(const capture::Capture& capture,
                                          const Point3<AcquisitionSpace, double>& middle,
                                          const CheckEffort& effort, const Progress& progress) {
  if (capture.views.size() != 1 || capture.lights.size() < 3) return {};
  const capture::Camera<World>& camera = capture.views[0].camera;
  std::vector<Sample> samples = samplesOf(camera.lens);
  std::vector<Vec3<double>> lights; // in the camera's axes, by shot
  std::vector<size_t> shots;        // light of each
  image::Image alpha;
  const std::vector<size_t> chosen =
      evenlySpaced(capture.frames.size(), std::min(effort.lightsOfView, kMostShots));
  for (size_t i = 0; i < chosen.size(); ++i) {
    progress("lights", static_cast<double>(i) / static_cast<double>(chosen.size()));
    const capture::Frame& frame = capture.frames[chosen[i]];
    const capture::Light& light = capture.lights[*frame.light];
    const double irradiance = static_cast<double>(image::luma(capture::irradianceAt(light, middle)));
    shots.push_back(*frame.light);
    lights.push_back(irradiance *
                     (camera.cameraFromWorld.rotation() * capture::towardsLight(light, middle).raw()));
    const capture::Photograph photograph =
        std::move(capture::readPhotographs(capture, std::span(&chosen[i], 1))[0]);
    for (Sample& sample : samples) {
      const auto texel = photograph.radiance.at(sample.x, sample.y);
      sample.shown.push_back(static_cast<double>(image::luma({texel[0], texel[1], texel[2]})));
      sample.brightest = std::max(sample.brightest, sample.shown.back());
    }
    if (photograph.hasMatte && alpha.values.empty()) alpha = photograph.alpha;
  }
  std::vector<double> brightest;
  for (const Sample& sample : samples) brightest.push_back(sample.brightest);
  if (brightest.empty()) return {}; // a picture lower than a step
  const auto at = brightest.begin() + static_cast<std::ptrdiff_t>(brightest.size() * 995 / 1000);
  std::nth_element(brightest.begin(), at, brightest.end());
  const double threshold = kLitObject * *at;

  std::erase_if(samples, [&](const Sample& sample) {
    return alpha.values.empty() ? !(sample.brightest > threshold) : !(alpha.at(sample.x, sample.y)[0] > 0.5f);
  });
  if (auto finding = checkOrder(samples, lights, shots, capture)) return {*finding};
  size_t all = 0, turned = 0, rim = 0;
  double outward = 0; // sum over the rim
  for (const Sample& sample : samples) {
    const auto g = scaledNormal(sample, lights);
    if (!g) continue;
    const auto ray = capture::rayThrough(camera.lens, {sample.x + 0.5, sample.y + 0.5});
    if (!ray) continue;
    ++all;
    turned += g->dot(ray->direction.raw()) > 0;
    const auto out = alpha.values.empty() ? std::nullopt : outwards(alpha, sample.x, sample.y);
    if (!out) continue;
    ++rim;
    outward += g->head<2>().dot(*out) / g->norm();
  }
  if (all < kFewestSamples) return {};
  const double share = static_cast<double>(turned) / static_cast<double>(all);
  const double across = rim >= kFewestSamples / 2 ? outward / static_cast<double>(rim) : 0;
  const std::string within = across < -kTurnedOutline  ? "x, y and z"
                             : across > kTurnedOutline ? "z"
                                                       : "z, or in x, y and z";
  if (share > kMostTurned)
    return {{Severity::error,
             fmt::format(
                 "light directions look negated in {}: by them, {:.0f} % of what the camera sees turns away "
                 "from it",
                 within, 100 * share)}};
  if (share < 1 - kMostTurned && across < -kTurnedOutline)
    return {{Severity::warning,
             fmt::format(
                 "light directions look negated in x and y: by them, the object turns inwards at its outline "
                 "({:.2f}, expected above 0), unless it is hollow there",
                 across)}};
  return {};
}

} // namespace surflect::validation
