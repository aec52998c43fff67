#include "render/verify/model_checks.h"

#include "srf/shading/plan.h"
#include "surfel/base/text.h"
#include "surfel/cloud.h"
#include "surfel/math/sphere_sampling.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace surflect::verify {

namespace {

constexpr uint8_t kSeenWell = 255; // code of a view that does not fade

// Random and unit, on the side of the normal.
Vec3<double> facing(const Vec3<double>& normal, std::mt19937& random) {
  std::normal_distribution<double> gaussian;
  const double x = gaussian(random), y = gaussian(random), z = gaussian(random);
  const Vec3<double> direction = Vec3<double>(x, y, z).normalized();
  return direction.dot(normal) < 0 ? Vec3<double>(-direction) : direction;
}

} // namespace

weights::QueryBatch randomQueries(const model::Model& model) {
  std::mt19937 random(39);
  weights::QueryBatch batch;
  batch.lights = model.rig.lights.empty() ? 0 : 1;
  for (const size_t i : evenlySpaced(model.cloud.size(), kTriedSurfels)) {
    const Vec3<double> normal = rotationOf<double>(model.cloud.r0[i]).col(2);
    batch.surfels.push_back(static_cast<uint32_t>(i));
    batch.towardsView.push_back(assume<Direction3<AcquisitionSpace>>(facing(normal, random)));
    if (batch.lights == 0) continue;
    batch.towardsLight.push_back(assume<Direction3<AcquisitionSpace>>(facing(normal, random)));
    batch.irradiance.push_back({1, 1, 1});
  }
  return batch;
}

MetQueries metQueries(const model::Model& model, const weights::ShadeOptions& options) {
  MetQueries met;
  met.batch.lights = model.rig.lights.empty() ? 0 : 1;
  const bool usesShadows = usesShadowStates(model, options);
  for (const size_t i : evenlySpaced(model.cloud.size(), kTriedSurfels)) {
    const auto fades = model.visibility.of(i);
    if (fades.empty()) continue;
    const auto view = static_cast<uint32_t>(std::ranges::max_element(fades) - fades.begin());
    if (fades[view] < kSeenWell) continue;
    const auto p0 = model.cloud.p0[i].cast<double>();
    met.view.push_back(view);
    met.column.push_back(0);
    met.batch.surfels.push_back(static_cast<uint32_t>(i));
    met.batch.towardsView.push_back(
        capture::Viewpoint<AcquisitionSpace>(model.rig.views[view].camera).towards(p0).cast<float>());
    if (met.batch.lights == 0) continue;
    const auto& lights = model.columns[view];
    met.column.back() = static_cast<uint32_t>(met.view.size() % lights.size());
    const uint32_t light = lights[met.column.back()];
    met.batch.towardsLight.push_back(capture::towardsLight(model.rig.lights[light], p0).cast<float>());
    met.batch.irradiance.push_back(capture::irradianceAt(model.rig.lights[light], p0));
    if (usesShadows)
      met.batch.reached.push_back(weights::VisibilityWeights::decode(model.lightVisibility->of(i)[light]));
  }
  return met;
}

namespace {

constexpr size_t kGapSurfels = 1000, kGapDirections = 100;
constexpr double kFacing = 0.3; // cosine from which a direction faces the surface: views do not fade there

double degrees(double radians) { return radians * 180 / std::numbers::pi; }

Vec3<double> unitFrom(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const double x = normal(random), y = normal(random), z = normal(random);
  return Vec3<double>(x, y, z).normalized();
}

std::string vectorText(const Vec3<double>& v) {
  return fmt::format("({:.3g}, {:.3g}, {:.3g})", v[0], v[1], v[2]);
}

// Laws of L at one surfel under a random affine warp A with determinant of the given sign: L is orthogonal,
// and mirrors as the warp does; L of the pure rotation R of a tangent plane is R^T; another choice of u0
// changes nothing. Returns the largest violation.
double lookUpViolation(const Mat3<double>& r0, std::mt19937& random) {
  std::normal_distribution<double> normal;
  Mat3<double> a;
  for (int i = 0; i < 9; ++i) a(i) = normal(random);
  const double sign = a.determinant() < 0 ? -1 : 1;
  const Vec3<double> u0 = r0.col(0), v0 = r0.col(1);
  const auto frame = polarFrame<double>(a * u0, a * v0);
  if (!frame) return 0; // collapsed: no L
  const Mat3<double> l = LookUp<double>(r0, *frame, sign).matrix();
  double violation = (l * l.transpose() - Mat3<double>::Identity()).cwiseAbs().maxCoeff();
  violation = std::max(violation, std::abs(l.determinant() - sign));
  const double turn = std::uniform_real_distribution<double>(0, 6)(random);
  const Vec3<double> u1 = std::cos(turn) * u0 + std::sin(turn) * v0,
                     v1 = std::cos(turn) * v0 - std::sin(turn) * u0;
  Mat3<double> r1;
  r1 << u1, v1, r0.col(2);
  // The condition of the tangent plane's map bounds how far rounding can turn its polar factor.
  const Vec3<double> u = a * u0, v = a * v0;
  const double condition = (u.squaredNorm() + v.squaredNorm()) / u.cross(v).norm();
  if (const auto other = polarFrame<double>(a * u1, a * v1))
    violation = std::max(violation,
                         (LookUp<double>(r1, *other, sign).matrix() - l).cwiseAbs().maxCoeff() / condition);
  const Mat3<double> rotation =
      Eigen::AngleAxisd(std::uniform_real_distribution<double>(0, 3)(random), unitFrom(random))
          .toRotationMatrix();
  if (const auto turned = polarFrame<double>(rotation * u0, rotation * v0))
    violation = std::max(
        violation, (LookUp<double>(r0, *turned, 1.0).matrix() - rotation.transpose()).cwiseAbs().maxCoeff());
  return violation;
}

Check lookUpCheck(const model::Model& model, const Bounds& bounds) {
  std::mt19937 random(38);
  double largest = 0;
  FlaggedPlace worst;
  for (const size_t i : evenlySpaced(model.cloud.size(), kTriedSurfels)) {
    const Mat3<double> r0 = rotationOf<double>(model.cloud.r0[i]);
    // Stored frames are single: their own error is part of the figure.
    const double violation = lookUpViolation(r0, random);
    if (!(violation <= largest))
      largest = violation, worst = placeOf(model, static_cast<uint32_t>(i), violation);
  }
  return judged("look_up", largest, bounds,
                fmt::format("at {} surfels under random affine warps, the laws of L hold to {:.1e}",
                            std::min(model.cloud.size(), kTriedSurfels), largest),
                {worst});
}

Check weightsCheck(const model::Model& model, const weights::ShadeOptions& options, const Bounds& bounds) {
  const weights::QueryBatch batch = randomQueries(model);
  const shading::ShadingPlan plan = shading::planShading(model, batch, options);
  const std::vector<double> sums = weightSums(plan);
  double error = 0;
  for (size_t place = 0; place < plan.places; ++place)
    error = std::max(error, weightError(plan, sums, place, batch.lights));
  return judged(
      "weights", error, bounds,
      fmt::format("from random views at {} surfels, weights sum to 1 within {:.1e}", batch.size(), error));
}

// Share of the cameras in the direction of the one that is met, in the weights of each target: of
// photographs, and of those that correct tables. The least of a query counts; without any, it is 0.
Check metViewCheck(const model::Model& model, const weights::ShadeOptions& options, const Bounds& bounds) {
  const auto [batch, met, columns] = metQueries(model, options);
  if (batch.size() == 0) return inapplicable("met_view", "no camera sees a surfel well");
  const shading::ShadingPlan plan = shading::planShading(model, batch, options);
  std::vector<capture::Viewpoint<AcquisitionSpace>> views;
  for (const capture::View& view : model.rig.views) views.emplace_back(view.camera);
  constexpr double kNoPhotograph = 2;
  const std::vector<double> sums = weightSums(plan);
  std::vector<double> weight(plan.targets(), 0);
  for (const shading::ShadingOp& op : plan.ops) {
    const size_t query = op.target / plan.targetsPerPlace;
    const auto p0 = model.cloud.p0[batch.surfels[query]].cast<double>();
    if (angleBetween(views[op.view].towards(p0).raw(), views[met[query]].towards(p0).raw()) < 1e-3)
      weight[op.target] += double{op.weight};
  }
  std::vector<double> least(batch.size(), kNoPhotograph);
  for (size_t target = 0; target < plan.targets(); ++target)
    if (sums[target] > 0)
      least[target / plan.targetsPerPlace] =
          std::min(least[target / plan.targetsPerPlace], weight[target] / sums[target]);
  for (double& each : least)
    if (each == kNoPhotograph) each = 0;
  const auto worst = std::ranges::min_element(least);
  const auto query = static_cast<size_t>(worst - least.begin());
  return judged(
      "met_view", 1 - *worst, bounds,
      fmt::format("at {} surfels asked from a captured camera under a captured light, other cameras take "
                  "at most {:.2g} of the weight",
                  batch.size(), std::max(0.0, 1 - *worst)),
      {placeOf(model, batch.surfels[query], 1 - *worst)});
}

// Share of the surface whose row of fades is 0, by the area of splats, with some of the places.
struct Dark {
  double percent = 0;
  size_t surfels = 0;
  std::vector<FlaggedPlace> places;
};
Dark darkIn(const model::Model& model, const weights::VisibilityWeights& fades) {
  double area = 0, dark = 0;
  std::vector<uint32_t> found;
  for (size_t i = 0; i < model.cloud.size(); ++i) {
    const double own = double{model.cloud.radius[i]} * double{model.cloud.radius[i]};
    if (model.cloud.coverage[i] == 0) continue; // beside the object
    area += own;
    if (std::ranges::any_of(fades.of(i), [](uint8_t fade) { return fade > 0; })) continue;
    dark += own;
    found.push_back(static_cast<uint32_t>(i));
  }
  Dark result{area > 0 ? 100 * dark / area : 0, found.size(), {}};
  for (const size_t i : evenlySpaced(found.size(), 3)) result.places.push_back(placeOf(model, found[i], 0));
  return result;
}

Check coverageCheck(const model::Model& model, const Bounds& bounds) {
  Dark dark = darkIn(model, model.visibility);
  return judged("coverage", dark.percent, bounds,
                fmt::format("{} of {} surfels are seen by no camera", dark.surfels, model.cloud.size()),
                std::move(dark.places));
}

Check unlitCheck(const model::Model& model, const Bounds& bounds) {
  if (!model.lightVisibility)
    return inapplicable("unlit", model.rig.lights.empty() ? "captured under fixed illumination"
                                                          : "the model stores no shadow states");
  Dark dark = darkIn(model, *model.lightVisibility);
  return judged(
      "unlit", dark.percent, bounds,
      fmt::format("{} of {} surfels are reached by no captured light", dark.surfels, model.cloud.size()),
      std::move(dark.places));
}

// The largest gap over sampled surfels and the directions that face them.
struct Gap {
  double angle = 0;
  uint32_t surfel = 0;
  Vec3<double> towards = {0, 0, 1};
  double median = 0; // over surfels, of their largest gaps
};
template <class NearestAngle> Gap largestGap(const model::Model& model, const NearestAngle& nearestAngle) {
  const std::vector<size_t> surfels = evenlySpaced(model.cloud.size(), kGapSurfels);
  const std::vector<Vec3<double>> directions = fibonacciSphere(kGapDirections, kFacing, 1);
  std::vector<Gap> gaps(surfels.size());
  tbb::parallel_for(size_t{0}, surfels.size(), [&](size_t k) {
    const Mat3<double> r0 = rotationOf<double>(model.cloud.r0[surfels[k]]);
    gaps[k].angle = -1; // of a surfel without sources
    for (const Vec3<double>& local : directions) {
      const Vec3<double> towards = r0 * local;
      const double angle = nearestAngle(surfels[k], towards);
      if (angle > gaps[k].angle) gaps[k] = {angle, static_cast<uint32_t>(surfels[k]), towards, 0};
    }
  });
  std::erase_if(gaps, [](const Gap& gap) { return gap.angle < 0; });
  if (gaps.empty()) return {-1, 0, {0, 0, 1}, 0};
  std::ranges::stable_sort(gaps, {}, &Gap::angle);
  Gap largest = gaps.back();
  largest.median = gaps[gaps.size() / 2].angle;
  return largest;
}

Check gapCheck(const char* rule, const char* source, const Gap& gap, const model::Model& model,
               const Bounds& bounds) {
  if (gap.angle < 0) return inapplicable(rule, fmt::format("no {} sees a sampled surfel", source));
  return judged(
      rule, degrees(gap.angle), bounds,
      fmt::format("the surfel with the largest gap lacks a {} towards {}; half of the surfels have gaps up "
                  "to {:.0f} degrees",
                  source, vectorText(gap.towards), degrees(gap.median)),
      {placeOf(model, gap.surfel, degrees(gap.angle))});
}

Check viewGapCheck(const model::Model& model, const Bounds& bounds) {
  std::vector<capture::Viewpoint<AcquisitionSpace>> views;
  for (const capture::View& view : model.rig.views) views.emplace_back(view.camera);
  const Gap gap = largestGap(model, [&](size_t surfel, const Vec3<double>& towards) {
    const auto fades = model.visibility.of(surfel);
    double nearest = -1;
    for (size_t view = 0; view < views.size(); ++view) {
      if (fades[view] == 0) continue;
      const double angle =
          angleBetween(views[view].towards(model.cloud.p0[surfel].cast<double>()).raw(), towards);
      nearest = nearest < 0 ? angle : std::min(nearest, angle);
    }
    return nearest;
  });
  return gapCheck("view_gap", "camera", gap, model, bounds);
}

Check lightGapCheck(const model::Model& model, const Bounds& bounds) {
  if (model.rig.lights.empty()) return inapplicable("light_gap", "captured under fixed illumination");
  const Gap gap = largestGap(model, [&](size_t surfel, const Vec3<double>& towards) {
    double nearest = std::numbers::pi;
    for (const capture::Light& light : model.rig.lights)
      nearest = std::min(
          nearest,
          angleBetween(capture::towardsLight(light, model.cloud.p0[surfel].cast<double>()).raw(), towards));
    return nearest;
  });
  return gapCheck("light_gap", "captured light", gap, model, bounds);
}

Check precisionCheck(const model::Model& model, const Bounds& bounds) {
  double largest = 0;
  FlaggedPlace worst;
  for (size_t i = 0; i < model.cloud.size(); ++i) {
    const double rounding = double{model.cloud.p0[i].raw().cwiseAbs().maxCoeff()} * 0x1p-24;
    const double share = 100 * rounding / double{model.cloud.radius[i]};
    if (!(share <= largest)) largest = share, worst = placeOf(model, static_cast<uint32_t>(i), share);
  }
  const double origin = model.rig.origin.norm();
  return judged("precision", largest, bounds,
                fmt::format("places are rounded by at most {:.1e} of a splat's radius{}", largest / 100,
                            origin > 0 ? fmt::format("; import moved the origin by {:.6g}", origin) : ""),
                {worst});
}

} // namespace

double angleBetween(const Vec3<double>& a, const Vec3<double>& b) {
  return 2 * std::asin(std::min(1.0, (a - b).norm() / 2));
}

double nearAngle(std::span<const Direction3<AcquisitionSpace, double>> directions) {
  constexpr double kLeast = 10, kMost = 45;
  const double spacing = degrees(weights::LightExtrapolationFade(directions).spacing());
  return std::clamp(spacing, kLeast, kMost) * std::numbers::pi / 180;
}

std::vector<Direction3<AcquisitionSpace, double>> viewDirections(const model::Model& model) {
  std::vector<Direction3<AcquisitionSpace, double>> directions;
  for (const capture::View& view : model.rig.views)
    directions.push_back(capture::Viewpoint<AcquisitionSpace>(view.camera).towards(model.middle));
  return directions;
}

std::vector<double> weightSums(const shading::ShadingPlan& plan) {
  std::vector<double> sums(plan.targets(), 0);
  for (const shading::ShadingOp& op : plan.ops) sums[op.target] += double{op.weight};
  return sums;
}

double weightError(const shading::ShadingPlan& plan, std::span<const double> sums, size_t place,
                   size_t lights) {
  const size_t blends = plan.targetsPerPlace - plan.tablesPerPlace;
  double largest = 0;
  for (size_t own = 0; own < (blends > 1 ? std::min(blends, lights) : blends); ++own) {
    const bool isOfLight = blends > 1 || lights == 1;
    if (plan.tablesPerPlace > 0 && isOfLight && plan.tableShares[place * plan.tablesPerPlace + own] >= 1)
      continue;
    const double error = std::abs(sums[place * plan.targetsPerPlace + own] - 1);
    largest = std::isnan(error) ? std::numeric_limits<double>::infinity() : std::max(largest, error);
  }
  return largest;
}

FlaggedPlace placeOf(const model::Model& model, uint32_t surfel, double figure) {
  return {surfel, model.cloud.p0[surfel].raw().cast<double>(), std::nullopt, figure};
}

std::vector<Check> modelChecks(const model::Model& model, weights::ShadeOptions options, const Bounds& bounds,
                               const Progress& progress) {
  options.usesAlpha = false; // weights of look-ups sum to 1 before they are multiplied by alpha
  std::vector<Check> checks;
  const auto add = [&](Check check) {
    checks.push_back(std::move(check));
    progress.checkpoint();
  };
  add(lookUpCheck(model, bounds));
  add(weightsCheck(model, options, bounds));
  add(metViewCheck(model, options, bounds));
  add(coverageCheck(model, bounds));
  add(unlitCheck(model, bounds));
  add(viewGapCheck(model, bounds));
  add(lightGapCheck(model, bounds));
  add(precisionCheck(model, bounds));
  return checks;
}

} // namespace surflect::verify
