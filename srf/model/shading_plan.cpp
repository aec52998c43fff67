#include "srf/model/shading_plan.h"

#include "srf/model/pair_planner.h"
#include "srf/model/product_planner.h"
#include "surfel/base/error.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cassert>
#include <limits>
#include <variant>

namespace surflect::model {

namespace {

constexpr size_t kTargetsPerPlan = 512;

using Planner = std::variant<ProductPlanner, PairPlanner>;

// Towards each light of the rig from the middle of the cloud.
std::vector<Direction3<AcquisitionSpace, double>> lightDirections(const Model& model) {
  std::vector<Direction3<AcquisitionSpace, double>> directions;
  for (const capture::Light& light : model.rig.lights)
    directions.push_back(capture::towardsLight(light, model.middle));
  return directions;
}

bool isProduct(const Model& model) { return model.rig.lights.empty() || model.isFullProduct; }

} // namespace

Rgb irradianceRatio(Rgb now, Rgb captured) {
  const auto divide = [](float a, float b) { return b > 0 ? a / b : 0; };
  return {divide(now.r, captured.r), divide(now.g, captured.g), divide(now.b, captured.b)};
}

ulr::LightBlend lightBlend(const Model& model, const ShadeOptions& options) {
  if (options.nearest) return {1, ulr::LightFit::mean};
  return {options.lights.value_or(model.lightBlend.lights), options.lightFit.value_or(model.lightBlend.fit),
          options.foreshortened.value_or(model.lightBlend.foreshortened)};
}

double lightSpacing(const Model& model) { return ulr::LightCoverage(lightDirections(model)).spacing(); }

std::optional<ulr::LightTable> lightTable(const Model& model, const ShadeOptions& options,
                                          ulr::LightExtrapolation extrapolation) {
  if (!model.isFullProduct || !std::ranges::all_of(model.rig.lights, isDirectional)) return std::nullopt;
  return ulr::LightTable(lightDirections(model), lightBlend(model, options),
                         options.nearest ? ulr::LightExtrapolation::clamp : extrapolation);
}

struct ShadingPlanner::Parts {
  const Model& model;
  const QueryBatch& batch;
  ShadeOptions options;
  ulr::LightCoverage coverage;
  size_t targetsPerQuery = isProduct(model) ? 1 : std::max(size_t{1}, batch.targets());
  tbb::enumerable_thread_specific<Planner> planners{[this] {
    return isProduct(model) ? Planner(std::in_place_type<ProductPlanner>, model, coverage, batch, options)
                            : Planner(std::in_place_type<PairPlanner>, model, coverage, batch, options);
  }};
  size_t queriesPerPlan =
      std::max(size_t{1}, kTargetsPerPlan / targetsPerQuery / ulr::kChoiceLanes) * ulr::kChoiceLanes;
  std::vector<ShadingPlan> plans = {};
  size_t begin = 0, end = 0; // of what is planned

  void plan(size_t first, size_t last, ShadingPlan& plan) {
    plan.queries = last - first;
    plan.targetsPerQuery = targetsPerQuery;
    plan.ops.clear();
    plan.rows.clear();
    plan.unseen = 0;
    plan.confidence.resize(plan.queries);
    const size_t blends = options.showsBlends ? plan.queries : 0;
    plan.cameraBlend.assign(blends, {});
    plan.lightBlend.assign(blends, {});
    std::visit([&](auto& planner) { planner.plan(first, plan); }, planners.local());
    if (std::max({plan.rows.weights.size(), plan.rows.lights.size(), plan.targets()}) >
        std::numeric_limits<uint32_t>::max())
      throw Error("too many surfels and lights to be planned at once");
  }
};

ShadingPlanner::ShadingPlanner(const Model& model, const QueryBatch& batch, const ShadeOptions& options) {
  assert(batch.towardsView.size() == batch.size());
  assert(batch.towardsLight.size() == batch.size() * batch.lights &&
         batch.irradiance.size() == batch.towardsLight.size());
  assert(batch.extrapolation.empty() || batch.extrapolation.size() == batch.lights);
  assert(batch.acquisitionFromEnvironment.size() == batch.size() * batch.environments.size());
  const size_t lights = batch.targets();
  if (model.rig.lights.empty() && lights > 0)
    throw Error("captured under fixed illumination: it cannot be lit by a light of the script")
        .in(model.folder);
  if (!model.rig.lights.empty() && lights == 0)
    throw Error("captured under several lights: the script needs a light of its own").in(model.folder);
  if (options.foreshortened.value_or(false) && (model.rig.lights.empty() || !model.isFullProduct))
    throw Error::mismatch("photographs under all lights from all cameras",
                          model.rig.lights.empty() ? "fixed illumination" : "pairs of cameras and lights")
        .at("foreshortening on")
        .in(model.folder);
  parts_ =
      std::unique_ptr<Parts>(new Parts{model, batch, options, ulr::LightCoverage(lightDirections(model))});
}

ShadingPlanner::~ShadingPlanner() = default;

size_t ShadingPlanner::targetsPerQuery() const { return parts_->targetsPerQuery; }

size_t ShadingPlanner::split(size_t begin, size_t end) {
  const size_t count = (end - begin + parts_->queriesPerPlan - 1) / parts_->queriesPerPlan;
  if (parts_->plans.size() < count) parts_->plans.resize(count);
  parts_->begin = begin;
  parts_->end = end;
  return count;
}

const ShadingPlan& ShadingPlanner::plan(size_t i) {
  const size_t first = parts_->begin + i * parts_->queriesPerPlan;
  parts_->plan(first, std::min(parts_->end, first + parts_->queriesPerPlan), parts_->plans[i]);
  return parts_->plans[i];
}

ShadingPlan ShadingPlanner::planAll() {
  ShadingPlan plan;
  parts_->plan(0, parts_->batch.size(), plan);
  return plan;
}

ShadingPlan planShading(const Model& model, const QueryBatch& batch, const ShadeOptions& options) {
  return ShadingPlanner(model, batch, options).planAll();
}

} // namespace surflect::model
