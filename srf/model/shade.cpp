#include "srf/model/shade.h"

#include "srf/query/ulr.h"
#include "surfel/error.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace surflect {

namespace {

constexpr size_t kQueriesPerTask = 512;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// A saturated colour that an index keeps for ever. Steps of sqrt(2) turns of hue: those of the golden section
// would give one colour to neighbours on a Fibonacci spiral, as which rigs are often laid out.
Rgb colorOf(uint32_t index) {
  const double turns = index * 0.41421356237309515;
  const double hue = 6 * (turns - std::floor(turns));
  const auto channel = [](double x) { return static_cast<float>(std::clamp(x, 0.0, 1.0)); };
  return {channel(std::abs(hue - 3) - 1), channel(2 - std::abs(hue - 2)), channel(2 - std::abs(hue - 4))};
}

// A light's weight is what falls on the surface now over what fell when the photograph was taken.
Rgb ratio(Rgb now, Rgb captured) {
  const auto divide = [](float a, float b) { return b > 0 ? a / b : 0; };
  return {divide(now.r, captured.r), divide(now.g, captured.g), divide(now.b, captured.b)};
}

struct PlannedOp {
  size_t target;
  uint32_t view;
  float weight;
  uint32_t rowBegin, rowEnd;
};

// Plans one query after the other; holds what it would otherwise allocate anew.
class Planner {
public:
  Planner(const Model& model, const QueryBatch& batch, const ShadeOptions& options)
      : model_(model), batch_(batch), options_(options), viewPenalty_(model.rig.views.size()),
        row_(model.rig.lights.size()) {
    for (const View& view : model.rig.views) viewpoints_.emplace_back(view.camera);
  }

  void plan(size_t query, ShadingPlan& plan) {
    const uint32_t surfel = batch_.surfels[query];
    p0_ = model_.cloud.p0[surfel].cast<double>();
    cameraBlend_ = lightBlend_ = {};
    seen_ = rateViews(surfel, batch_.towardsView[query]);
    if (!seen_) ++plan.unseen;
    if (model_.rig.lights.empty())
      planFixedIllumination(query, plan);
    else if (model_.isFullProduct)
      planProduct(query, plan);
    else
      planPairs(query, plan);
    for (const PlannedOp& op : ops_) {
      const auto pixel = model_.rig.views[op.view].camera.project(p0_);
      if (!pixel) continue;
      plan.ops.push_back({static_cast<uint32_t>(op.target), op.view, static_cast<float>(pixel->x),
                          static_cast<float>(pixel->y), op.weight, op.rowBegin, op.rowEnd});
    }
    plan.cameraBlend.push_back(cameraBlend_);
    plan.lightBlend.push_back(lightBlend_);
    ops_.clear();
  }

private:
  // Penalty over fade of every view, so that a view which fades leaves the blend without a jump. Where none
  // sees the surfel, those that have it in their image are rated by angle alone; returns false then.
  bool rateViews(uint32_t surfel, const Direction3<AcquisitionSpace>& towardsView) {
    const auto fades = model_.fades.of(surfel);
    const bool seen = std::ranges::any_of(fades, [](uint8_t fade) { return fade > 0; });
    for (size_t view = 0; view < viewPenalty_.size(); ++view) {
      const auto& camera = model_.rig.views[view].camera;
      viewPenalty_[view] = kInfinity;
      if (seen && fades[view] == 0) continue;
      const float penalty = anglePenalty(viewpoints_[view].towards(p0_).template cast<float>(), towardsView);
      if (seen) {
        viewPenalty_[view] = options_.nearest ? penalty : penalty / ViewFades::decode(fades[view]);
      } else if (const auto pixel = camera.project(p0_); pixel && contains(camera.lens, *pixel)) {
        viewPenalty_[view] = penalty;
      }
    }
    return seen;
  }

  // How many are blended; the nearest alone stands in where no camera sees the surfel.
  size_t blended(size_t wanted) const { return options_.nearest || !seen_ ? 1 : wanted; }

  BlendSet blendViews() const {
    NearestCandidates nearest(blended(options_.cameras));
    for (uint32_t view = 0; view < viewPenalty_.size(); ++view) nearest.offer({view, viewPenalty_[view]});
    return ulrWeights(nearest);
  }

  void planFixedIllumination(size_t query, ShadingPlan& plan) {
    const auto row = static_cast<uint32_t>(plan.rows.size());
    plan.rows.push_back({0, {1, 1, 1}});
    for (const auto& [view, weight] : blendViews()) {
      ops_.push_back({query, view, weight, row, row + 1});
      cameraBlend_ = cameraBlend_ + weight * colorOf(view);
    }
  }

  // Cameras and lights apart. All cameras hold the same lights, so they share a row.
  void planProduct(size_t query, ShadingPlan& plan) {
    const auto rowBegin = static_cast<uint32_t>(plan.rows.size());
    foldLights(query, plan.rows);
    const auto rowEnd = static_cast<uint32_t>(plan.rows.size());
    for (const auto& [view, weight] : blendViews()) {
      ops_.push_back({query, view, weight, rowBegin, rowEnd});
      cameraBlend_ = cameraBlend_ + weight * colorOf(view);
    }
  }

  // Adds a row: all script lights, each spread over its nearest captured lights.
  void foldLights(size_t query, std::vector<LightWeight>& rows) {
    std::ranges::fill(row_, Rgb{});
    for (size_t l = 0; l < batch_.lights; ++l) {
      const size_t entry = query * batch_.lights + l;
      NearestCandidates nearest(options_.nearest ? 1 : options_.lights);
      for (uint32_t light = 0; light < row_.size(); ++light)
        nearest.offer({light, lightPenalty(light, entry)});
      for (const auto& [light, weight] : ulrWeights(nearest)) {
        const Rgb captured = irradianceAt(model_.rig.lights[light], p0_);
        row_[light] = row_[light] + weight * ratio(batch_.irradiance[entry], captured);
        lightBlend_ = lightBlend_ + weight / static_cast<float>(batch_.lights) * colorOf(light);
      }
    }
    for (uint32_t light = 0; light < row_.size(); ++light)
      if (row_[light] != Rgb{}) rows.push_back({light, row_[light]});
  }

  float lightPenalty(uint32_t light, size_t entry) const {
    return anglePenalty(towardsLight(model_.rig.lights[light], p0_).template cast<float>(),
                        batch_.towardsLight[entry]);
  }

  // Camera and light chosen together, by the sum of their penalties; each pair is an operation of its own.
  void planPairs(size_t query, ShadingPlan& plan) {
    for (size_t l = 0; l < batch_.lights; ++l) {
      const size_t entry = query * batch_.lights + l;
      NearestCandidates nearest(blended(options_.pairs));
      uint32_t pair = 0;
      for (size_t view = 0; view < model_.columns.size(); ++view)
        for (const uint32_t light : model_.columns[view]) {
          if (viewPenalty_[view] < kInfinity)
            nearest.offer({pair, viewPenalty_[view] + lightPenalty(light, entry)});
          ++pair;
        }
      for (const auto& [chosen, weight] : ulrWeights(nearest)) {
        uint32_t view = 0, column = chosen;
        for (; column >= model_.columns[view].size(); ++view)
          column -= static_cast<uint32_t>(model_.columns[view].size());
        const uint32_t light = model_.columns[view][column];
        const auto row = static_cast<uint32_t>(plan.rows.size());
        plan.rows.push_back(
            {column, ratio(batch_.irradiance[entry], irradianceAt(model_.rig.lights[light], p0_))});
        ops_.push_back({entry, view, weight, row, row + 1});
        const float share = weight / static_cast<float>(batch_.lights);
        cameraBlend_ = cameraBlend_ + share * colorOf(view);
        lightBlend_ = lightBlend_ + share * colorOf(light);
      }
    }
  }

  const Model& model_;
  const QueryBatch& batch_;
  const ShadeOptions& options_;
  std::vector<Viewpoint<AcquisitionSpace>> viewpoints_;
  std::vector<float> viewPenalty_; // per view, of the current query
  std::vector<Rgb> row_;           // per light
  bool seen_ = true;               // by a camera
  std::vector<PlannedOp> ops_;
  Point3<AcquisitionSpace, double> p0_;
  Rgb cameraBlend_, lightBlend_;
};

void append(ShadingPlan& all, ShadingPlan& part) {
  if (all.rows.size() + part.rows.size() > std::numeric_limits<uint32_t>::max())
    throw Error("too many surfels and lights for one frame");
  const auto offset = static_cast<uint32_t>(all.rows.size());
  for (ShadingOp& op : part.ops) {
    op.rowBegin += offset;
    op.rowEnd += offset;
  }
  all.ops.insert(all.ops.end(), part.ops.begin(), part.ops.end());
  all.rows.insert(all.rows.end(), part.rows.begin(), part.rows.end());
  all.cameraBlend.insert(all.cameraBlend.end(), part.cameraBlend.begin(), part.cameraBlend.end());
  all.lightBlend.insert(all.lightBlend.end(), part.lightBlend.begin(), part.lightBlend.end());
  all.unseen += part.unseen;
}

} // namespace

ShadingPlan planShading(const Model& model, const QueryBatch& batch, const ShadeOptions& options) {
  assert(batch.towardsView.size() == batch.size());
  assert(batch.towardsLight.size() == batch.size() * batch.lights &&
         batch.irradiance.size() == batch.towardsLight.size());
  if (model.rig.lights.empty() && batch.lights > 0)
    throw Error("captured under fixed illumination: it cannot be lit by a light of the script")
        .in(model.folder);
  if (!model.rig.lights.empty() && batch.lights == 0)
    throw Error("captured under several lights: the script needs a light of its own").in(model.folder);
  const size_t tasks = (batch.size() + kQueriesPerTask - 1) / kQueriesPerTask;
  std::vector<ShadingPlan> parts(tasks);
  tbb::parallel_for(size_t{0}, tasks, [&](size_t task) {
    Planner planner(model, batch, options);
    const size_t end = std::min(batch.size(), (task + 1) * kQueriesPerTask);
    for (size_t query = task * kQueriesPerTask; query < end; ++query) planner.plan(query, parts[task]);
  });
  ShadingPlan plan;
  plan.queries = batch.size();
  plan.targetsPerQuery = model.rig.lights.empty() || model.isFullProduct ? 1 : batch.lights;
  for (ShadingPlan& part : parts) append(plan, part);
  return plan;
}

std::vector<Rgb> shade(const ShadingPlan& plan, BlockCache& cache, ShadingStats& stats) {
  const auto targets = execute(plan.ops, plan.rows, plan.queries * plan.targetsPerQuery, cache, stats);
  if (plan.targetsPerQuery == 1) return targets;
  std::vector<Rgb> radiance(plan.queries);
  for (size_t target = 0; target < targets.size(); ++target)
    radiance[target / plan.targetsPerQuery] = radiance[target / plan.targetsPerQuery] + targets[target];
  return radiance;
}

std::vector<Rgb> shade(const Model& model, const QueryBatch& batch, const ShadeOptions& options,
                       BlockCache& cache, ShadingStats& stats) {
  return shade(planShading(model, batch, options), cache, stats);
}

} // namespace surflect
