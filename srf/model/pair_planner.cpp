#include "srf/model/pair_planner.h"

#include <algorithm>
#include <limits>

namespace surflect::model {

PairPlanner::PairPlanner(const Model& model, const ulr::LightCoverage& coverage, const QueryBatch& batch,
                         const ShadeOptions& options)
    : model_(model), coverage_(coverage), batch_(batch), options_(options),
      views_(model, options.nearest, options.simd), lights_(model.rig.lights),
      projectors_(projectorsOf(model.rig.views)), viewColor_(indexColors(model.rig.views.size())),
      lightColor_(indexColors(model.rig.lights.size())), environmentBrightness_(environmentBrightness(batch)),
      lightPenalty_(model.rig.lights.size()) {
  for (const auto& lights : model.columns) {
    firstPair_.push_back(pairs_);
    pairs_ += lights.size();
  }
}

void PairPlanner::plan(size_t begin, ShadingPlan& plan) {
  for (size_t i = 0; i < plan.queries; ++i) {
    const BlendColors colors = planQuery(begin + i, i * plan.targetsPerQuery, plan);
    if (plan.cameraBlend.empty()) continue;
    plan.cameraBlend[i] = colors.cameras;
    plan.lightBlend[i] = colors.lights;
  }
}

PairPlanner::BlendColors PairPlanner::planQuery(size_t query, size_t target, ShadingPlan& plan) {
  BlendColors colors;
  place_ = model_.cloud.p0[batch_.surfels[query]].cast<double>();
  lights_.lookFrom(place_);
  lights_.faceAll();
  const Sight sight = views_.rate(batch_.surfels[query], batch_.towardsView[query]);
  if (!sight.isSeen) ++plan.unseen;
  plan.confidence[target / plan.targetsPerQuery] = ulr::confidenceOf(sight.penalty);
  const auto targets = static_cast<float>(batch_.targets());
  for (size_t l = 0; l < batch_.lights; ++l) {
    const size_t entry = query * batch_.lights + l;
    const float covered = rate(batch_.towardsLight[entry], batch_.uncoveredOf(l));
    for (const auto& [pair, weight] : blend()) {
      const auto [view, column, light] = placeOf(pair);
      const size_t row = plan.rows.lights.size();
      plan.rows.add(column, covered * irradianceRatio(batch_.irradiance[entry], lights_.irradiance(light)));
      // Each pair is an operation of its own.
      ask(projectors_, place_, {target + l, view, weight, row, row + 1}, plan);
      const float share = weight / targets;
      colors.cameras = colors.cameras + share * viewColor_[view];
      colors.lights = colors.lights + covered * share * lightColor_[light];
    }
  }
  for (size_t e = 0; e < batch_.environments.size(); ++e) planEnvironment(query, e, target, plan, colors);
  return colors;
}

// The pairs of all the environment's lights; those of one view are one operation.
void PairPlanner::planEnvironment(size_t query, size_t e, size_t target, ShadingPlan& plan,
                                  BlendColors& colors) {
  const QueryEnvironment& environment = batch_.environments[e];
  const auto& acquisitionFromEnvironment = batch_.turnOf(query, e);
  pairShare_.assign(pairs_, Rgb{});
  for (const auto& [towards, irradiance] : environment.lights) {
    const float covered = rate(acquisitionFromEnvironment(towards), environment.extrapolation);
    for (const auto& [pair, weight] : blend())
      pairShare_[pair] = pairShare_[pair] + covered * weight * irradiance;
  }
  const auto targets = static_cast<float>(batch_.targets());
  const auto colorShare = [&](float ofLight) { return ofLight / (environmentBrightness_[e] * targets); };
  for (uint32_t view = 0; view < model_.columns.size(); ++view) {
    const auto& lights = model_.columns[view];
    float brightnessOfView = 0;
    for (size_t column = 0; column < lights.size(); ++column)
      brightnessOfView += brightness(pairShare_[firstPair_[view] + column]);
    if (!(brightnessOfView > 0)) continue;
    const float weight = brightnessOfView / environmentBrightness_[e];
    const size_t rowBegin = plan.rows.lights.size();
    for (uint32_t column = 0; column < lights.size(); ++column) {
      const Rgb share = pairShare_[firstPair_[view] + column];
      if (share == Rgb{}) continue;
      plan.rows.add(column,
                    1 / weight *
                        irradianceRatio(environment.strength * share, lights_.irradiance(lights[column])));
      colors.lights = colors.lights + colorShare(brightness(share)) * lightColor_[lights[column]];
    }
    ask(projectors_, place_, {target + batch_.lights + e, view, weight, rowBegin, plan.rows.lights.size()},
        plan);
    colors.cameras = colors.cameras + colorShare(brightnessOfView) * viewColor_[view];
  }
}

// Penalties of the rig's lights for a direction, and its coverage.
float PairPlanner::rate(const Direction3<AcquisitionSpace>& towards, ulr::LightExtrapolation extrapolation) {
  float smallest = std::numeric_limits<float>::infinity();
  for (size_t light = 0; light < lights_.size(); ++light) {
    lightPenalty_[light] = ulr::anglePenalty(lights_.towards(light), towards);
    smallest = std::min(smallest, lightPenalty_[light]);
  }
  return extrapolation == ulr::LightExtrapolation::fade && !options_.nearest ? coverage_.at(smallest) : 1.f;
}

ulr::BlendSet PairPlanner::blend() const {
  ulr::NearestCandidates nearest(options_.nearest ? 1 : options_.pairs);
  for (size_t view = 0; view < model_.columns.size(); ++view) {
    const auto& lights = model_.columns[view];
    for (size_t column = 0; column < lights.size(); ++column)
      nearest.offer({static_cast<uint32_t>(firstPair_[view] + column),
                     views_.with(view, lightPenalty_[lights[column]])});
  }
  return ulr::ulrWeights(nearest);
}

PairPlanner::Pair PairPlanner::placeOf(uint32_t pair) const {
  const auto next = std::ranges::upper_bound(firstPair_, size_t{pair});
  const auto view = static_cast<uint32_t>(next - firstPair_.begin() - 1);
  const auto column = static_cast<uint32_t>(pair - firstPair_[view]);
  return {view, column, model_.columns[view][column]};
}

} // namespace surflect::model
