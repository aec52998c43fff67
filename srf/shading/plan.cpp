#include "srf/shading/plan.h"

#include "srf/shading/blend_colors.h"
#include "srf/shading/camera_weights.h"
#include "srf/shading/pair_weights.h"
#include "surfel/base/error.h"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cassert>
#include <limits>
#include <variant>

namespace surflect::shading {

namespace {

constexpr size_t kTargetsPerPlan = 512;

// Appends look-ups to a plan.
class Emitter {
public:
  explicit Emitter(std::span<const capture::View> views) {
    for (const capture::View& view : views) projectors_.emplace_back(view.camera);
  }

  // Adds a look-up of `place` in a view for a target, under the light row [begin, end). Does nothing if the
  // place does not project into the view.
  void emit(const Point3<AcquisitionSpace, double>& place, size_t target, uint32_t view, float weight,
            size_t begin, size_t end, ShadingPlan& plan) const {
    const auto pixel = projectors_[view](place);
    if (!pixel) return;
    plan.ops.push_back({static_cast<uint32_t>(target), view, static_cast<float>(pixel->x),
                        static_cast<float>(pixel->y), weight, static_cast<uint32_t>(begin),
                        static_cast<uint32_t>(end)});
  }

private:
  std::vector<capture::Projector<AcquisitionSpace>> projectors_; // one for each view
};

// Plans cameras and lights with separate weights: one operation for each query and camera.
class ProductPlanner {
public:
  ProductPlanner(const ReflectanceField& field, const ulr::LightExtrapolationFade& coverage,
                 const QueryBatch& batch, const ShadeOptions& options)
      : field_(field), batch_(batch), cameras_(field, batch, options),
        lights_(field, coverage, batch, options), emitter_(field.rig.views),
        viewColor_(blendColors(field.rig.views.size())) {}

  void plan(size_t begin, ShadingPlan& plan) {
    const bool isLit = !field_.rig.lights.empty(), showsBlends = !plan.cameraBlend.empty();
    for (size_t first = 0; first < plan.queries; first += ulr::kQueryLanes) {
      const size_t count = std::min(ulr::kQueryLanes, plan.queries - first);
      if (isLit) lights_.prepare(begin + first, count, plan.rows);
      cameras_.prepare(begin + first, count);
      for (size_t lane = 0; lane < count; ++lane) {
        const size_t target = first + lane;
        const LightWeights::Row row = isLit ? lights_.append(lane, plan.rows) : fixedLight(plan.rows);
        if (isLit && showsBlends) plan.lightBlend[target] = lights_.blendColor();
        const auto place = field_.cloud.p0[batch_.surfels[begin + target]].cast<double>();
        const BestView best = cameras_.forEach(lane, [&](uint32_t view, float weight) {
          emitter_.emit(place, target, view, weight, row.begin, row.end, plan);
          if (showsBlends) plan.cameraBlend[target] = plan.cameraBlend[target] + weight * viewColor_[view];
        });
        plan.confidence[target] = ulr::confidenceOf(best.penalty);
        if (!best.isSeen) ++plan.unseen;
      }
    }
  }

private:
  // Row of a capture under fixed illumination: its only column, unchanged.
  static LightWeights::Row fixedLight(LightRows& rows) {
    rows.add(0, {1, 1, 1});
    return {rows.lights.size() - 1, rows.lights.size()};
  }

  const ReflectanceField& field_;
  const QueryBatch& batch_;
  CameraWeights cameras_;
  LightWeights lights_;
  Emitter emitter_;
  std::vector<Rgb> viewColor_;
};

// Plans (camera, light) pairs: one operation for each pair, or for each view and environment.
class PairPlanner {
public:
  PairPlanner(const ReflectanceField& field, const ulr::LightExtrapolationFade& coverage,
              const QueryBatch& batch, const ShadeOptions& options)
      : field_(field), batch_(batch), pairs_(field, coverage, batch, options), emitter_(field.rig.views),
        viewColor_(blendColors(field.rig.views.size())), lightColor_(blendColors(field.rig.lights.size())),
        environmentBrightness_(environmentBrightness(batch)) {}

  void plan(size_t begin, ShadingPlan& plan) {
    for (size_t i = 0; i < plan.queries; ++i) {
      cameraColor_ = lightBlendColor_ = {};
      const BestView best = pairs_.prepare(begin + i);
      plan.confidence[i] = ulr::confidenceOf(best.penalty);
      if (!best.isSeen) ++plan.unseen;
      const size_t target = i * plan.targetsPerQuery;
      for (size_t l = 0; l < batch_.lights; ++l) planLight(begin + i, l, target + l, plan);
      for (size_t e = 0; e < batch_.environments.size(); ++e)
        planEnvironment(begin + i, e, target + batch_.lights + e, plan);
      if (plan.cameraBlend.empty()) continue;
      plan.cameraBlend[i] = cameraColor_;
      plan.lightBlend[i] = lightBlendColor_;
    }
  }

private:
  void planLight(size_t query, size_t l, size_t target, ShadingPlan& plan) {
    const size_t entry = query * batch_.lights + l;
    const auto sources = static_cast<float>(batch_.sources());
    const auto [weights, covered] = pairs_.blend(batch_.towardsLight[entry], batch_.extrapolationOf(l));
    for (const auto& [number, weight] : weights) {
      const auto [view, column, light] = pairs_.pair(number);
      const size_t row = plan.rows.lights.size();
      plan.rows.add(column, covered * irradianceRatio(batch_.irradiance[entry], pairs_.irradiance(light)));
      emitter_.emit(pairs_.place(), target, view, weight, row, row + 1, plan);
      const float share = weight / sources;
      cameraColor_ = cameraColor_ + share * viewColor_[view];
      lightBlendColor_ = lightBlendColor_ + covered * share * lightColor_[light];
    }
  }

  // Sums the irradiance of the environment's lights that each pair represents; the pairs of one view become
  // one operation.
  void planEnvironment(size_t query, size_t e, size_t target, ShadingPlan& plan) {
    const QueryEnvironment& environment = batch_.environments[e];
    const auto& rotation = batch_.rotationOf(query, e);
    pairShare_.assign(pairs_.size(), Rgb{});
    for (const auto& [towards, irradiance] : environment.lights) {
      const auto [weights, covered] = pairs_.blend(rotation(towards), environment.extrapolation);
      for (const auto& [number, weight] : weights)
        pairShare_[number] = pairShare_[number] + covered * weight * irradiance;
    }
    const auto sources = static_cast<float>(batch_.sources());
    const auto colorShare = [&](float ofLight) { return ofLight / (environmentBrightness_[e] * sources); };
    for (uint32_t view = 0; view < field_.columns.size(); ++view) {
      const auto& lights = field_.columns[view];
      const std::span shares = std::span(pairShare_).subspan(pairs_.firstPairOf(view), lights.size());
      float brightnessOfView = 0;
      for (const Rgb& share : shares) brightnessOfView += brightness(share);
      if (!(brightnessOfView > 0)) continue;
      const float weight = brightnessOfView / environmentBrightness_[e];
      const size_t rowBegin = plan.rows.lights.size();
      for (uint32_t column = 0; column < lights.size(); ++column) {
        const Rgb share = shares[column];
        if (share == Rgb{}) continue;
        plan.rows.add(column,
                      1 / weight *
                          irradianceRatio(environment.strength * share, pairs_.irradiance(lights[column])));
        lightBlendColor_ = lightBlendColor_ + colorShare(brightness(share)) * lightColor_[lights[column]];
      }
      emitter_.emit(pairs_.place(), target, view, weight, rowBegin, plan.rows.lights.size(), plan);
      cameraColor_ = cameraColor_ + colorShare(brightnessOfView) * viewColor_[view];
    }
  }

  const ReflectanceField& field_;
  const QueryBatch& batch_;
  PairWeights pairs_;
  Emitter emitter_;
  std::vector<Rgb> viewColor_, lightColor_;
  std::vector<float> environmentBrightness_;
  Rgb cameraColor_, lightBlendColor_; // blend colours of the current query
  std::vector<Rgb> pairShare_;        // per pair: share of the current environment's irradiance
};

using Planner = std::variant<ProductPlanner, PairPlanner>;

void requireLights(const ReflectanceField& field, const QueryBatch& batch, const ShadeOptions& options) {
  const bool isFixed = field.rig.lights.empty();
  if (isFixed && batch.sources() > 0)
    throw Error("captured under fixed illumination: it cannot be lit by a light of the script")
        .in(field.folder);
  if (!isFixed && batch.sources() == 0)
    throw Error("captured under several lights: the script needs a light of its own").in(field.folder);
  if (options.foreshortened.value_or(false) && (isFixed || !field.isFullProduct))
    throw Error::mismatch("photographs under all lights from all cameras",
                          isFixed ? "fixed illumination" : "pairs of cameras and lights")
        .at("foreshortening on")
        .in(field.folder);
}

} // namespace

struct ShadingPlanner::Impl {
  const ReflectanceField& field;
  const QueryBatch& batch;
  ShadeOptions options;
  ulr::LightExtrapolationFade coverage{lightDirections(field)};
  size_t targetsPerQuery = field.hasSeparateWeights() ? 1 : std::max(size_t{1}, batch.sources());
  tbb::enumerable_thread_specific<Planner> planners{[this] {
    return field.hasSeparateWeights()
               ? Planner(std::in_place_type<ProductPlanner>, field, coverage, batch, options)
               : Planner(std::in_place_type<PairPlanner>, field, coverage, batch, options);
  }};
};

ShadingPlanner::ShadingPlanner(const ReflectanceField& field, const QueryBatch& batch,
                               const ShadeOptions& options) {
  assert(batch.towardsView.size() == batch.size());
  assert(batch.towardsLight.size() == batch.size() * batch.lights &&
         batch.irradiance.size() == batch.towardsLight.size());
  assert(batch.extrapolation.empty() || batch.extrapolation.size() == batch.lights);
  assert(batch.acquisitionFromEnvironment.size() == batch.size() * batch.environments.size());
  requireLights(field, batch, options);
  impl_ = std::unique_ptr<Impl>(new Impl{field, batch, options});
}

ShadingPlanner::~ShadingPlanner() = default;

size_t ShadingPlanner::targetsPerQuery() const { return impl_->targetsPerQuery; }

size_t ShadingPlanner::queriesPerPlan() const {
  return std::max(size_t{1}, kTargetsPerPlan / targetsPerQuery() / ulr::kQueryLanes) * ulr::kQueryLanes;
}

void ShadingPlanner::plan(size_t begin, size_t end, ShadingPlan& plan) {
  plan.queries = end - begin;
  plan.targetsPerQuery = targetsPerQuery();
  plan.ops.clear();
  plan.rows.clear();
  plan.unseen = 0;
  plan.confidence.resize(plan.queries);
  const size_t blends = impl_->options.showsBlends ? plan.queries : 0;
  plan.cameraBlend.assign(blends, {});
  plan.lightBlend.assign(blends, {});
  std::visit([&](auto& planner) { planner.plan(begin, plan); }, impl_->planners.local());
  if (std::max({plan.rows.weights.size(), plan.rows.lights.size(), plan.targets()}) >
      std::numeric_limits<uint32_t>::max())
    throw Error("too many surfels and lights to be planned at once");
}

ShadingPlan planShading(const ReflectanceField& field, const QueryBatch& batch, const ShadeOptions& options) {
  ShadingPlan plan;
  ShadingPlanner(field, batch, options).plan(0, batch.size(), plan);
  return plan;
}

} // namespace surflect::shading
