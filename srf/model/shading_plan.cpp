#include "srf/model/shading_plan.h"

#include "srf/model/view_penalties.h"
#include "srf/query/candidate_sieve.h"
#include "srf/query/foreshortening.h"
#include "srf/query/ulr.h"
#include "surfel/bounds.h"
#include "surfel/error.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

namespace surflect {

namespace {

constexpr size_t kQueriesPerTask = 512;

// A saturated colour that an index keeps for ever. Steps of sqrt(2) turns of hue: those of the golden section
// would give one colour to neighbours on a Fibonacci spiral, as which rigs are often laid out.
Rgb colorOf(uint32_t index) {
  const double turns = index * 0.41421356237309515;
  const double hue = 6 * (turns - std::floor(turns));
  const auto channel = [](double x) { return static_cast<float>(std::clamp(x, 0.0, 1.0)); };
  return {channel(std::abs(hue - 3) - 1), channel(2 - std::abs(hue - 2)), channel(2 - std::abs(hue - 4))};
}

float brightness(Rgb light) { return light.r + light.g + light.b; }

// Towards each light of the rig from the middle of the cloud.
std::vector<Direction3<AcquisitionSpace, double>>
lightDirections(const Model& model, const Point3<AcquisitionSpace, double>& middle) {
  std::vector<Direction3<AcquisitionSpace, double>> directions;
  for (const Light& light : model.rig.lights) directions.push_back(towardsLight(light, middle));
  return directions;
}

bool isDirectional(const Light& light) { return std::holds_alternative<DirectionalLight>(light.kind); }

std::vector<Source> sourcesOf(std::span<const Light> lights) {
  std::vector<Source> sources;
  for (const Light& light : lights) {
    const auto* point = std::get_if<PointLight>(&light.kind);
    sources.push_back({point ? point->position.raw() : towardsLight(light, {}).raw(), !point});
  }
  return sources;
}

std::vector<Rgb> colors(size_t count) {
  std::vector<Rgb> all;
  for (uint32_t i = 0; i < count; ++i) all.push_back(colorOf(i));
  return all;
}

struct PlannedOp {
  size_t target;
  uint32_t view;
  float weight;
  uint32_t rowBegin, rowEnd;
};

// Of some of a plan's queries; rows count from 0.
struct PlanPart {
  std::vector<ShadingOp> ops;
  std::vector<LightWeight> rows;
  size_t unseen = 0;

  void clear() {
    ops.clear();
    rows.clear();
    unseen = 0;
  }
};

// Plans one query after the other; holds what it would otherwise allocate anew.
class Planner {
public:
  Planner(const Model& model, const Point3<AcquisitionSpace, double>& middle, const LightCoverage& coverage,
          const QueryBatch& batch, const ShadeOptions& options)
      : model_(model), coverage_(coverage), batch_(batch), options_(options),
        views_(model, middle, options.nearest, options.simd),
        lightBlending_(surflect::lightBlend(model, options)),
        lightSieve_(sourcesOf(model.rig.lights), middle.raw(), options.simd),
        viewColor_(colors(model.rig.views.size())), lightColor_(colors(model.rig.lights.size())),
        towardsRigLight_(model.rig.lights.size()), rigIrradiance_(towardsRigLight_.size()),
        facedFrom_(towardsRigLight_.size(), kNowhere), lightPenalty_(towardsRigLight_.size()),
        row_(towardsRigLight_.size()), inRow_(towardsRigLight_.size() / 64 + 1),
        share_(towardsRigLight_.size()), cosine_(towardsRigLight_.size()) {
    for (const auto& lights : model.columns) {
      firstPair_.push_back(pairs_);
      pairs_ += lights.size();
    }
    for (const QueryEnvironment& environment : batch.environments)
      environmentBrightness_.push_back(brightness(totalIrradiance(environment.lights)));
  }

  // Its targets begin at `target`.
  void plan(size_t query, size_t target, PlanPart& plan) {
    const uint32_t surfel = batch_.surfels[query];
    p0_ = model_.cloud.p0[surfel].cast<double>();
    query_ = query;
    target_ = target;
    cameraBlend_ = lightBlend_ = {};
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
    ops_.clear();
  }

  // Of the last query.
  Rgb cameraBlend() const { return cameraBlend_; }
  Rgb lightBlend() const { return lightBlend_; }

private:
  static constexpr size_t kNowhere = std::numeric_limits<size_t>::max(), kEverywhere = kNowhere - 1;

  // Direction to a light of the rig, and its irradiance, at the current query.
  void face(uint32_t light) {
    if (facedFrom_[light] == query_ || facedFrom_[light] == kEverywhere) return;
    const Light& captured = model_.rig.lights[light];
    towardsRigLight_[light] = towardsLight(captured, p0_).cast<float>();
    rigIrradiance_[light] = irradianceAt(captured, p0_);
    facedFrom_[light] = isDirectional(captured) ? kEverywhere : query_;
  }
  void faceAll() {
    for (uint32_t light = 0; light < facedFrom_.size(); ++light) face(light);
  }

  // The cameras that are blended for a query, without regard to lights.
  BlendSet blendViews(size_t query, PlanPart& plan) {
    const auto [blend, isSeen] =
        views_.blend(batch_.surfels[query], batch_.towardsView[query], blended(options_.cameras));
    if (!isSeen) ++plan.unseen;
    for (const auto& [view, weight] : blend) cameraBlend_ = cameraBlend_ + weight * viewColor_[view];
    return blend;
  }

  // How many are blended.
  size_t blended(size_t wanted) const { return options_.nearest ? 1 : wanted; }

  void planFixedIllumination(size_t query, PlanPart& plan) {
    const auto row = static_cast<uint32_t>(plan.rows.size());
    plan.rows.push_back({0, {1, 1, 1}});
    for (const auto& [view, weight] : blendViews(query, plan))
      ops_.push_back({target_, view, weight, row, row + 1});
  }

  // Cameras and lights apart. All cameras hold the same lights, so they share a row.
  void planProduct(size_t query, PlanPart& plan) {
    const auto rowBegin = static_cast<uint32_t>(plan.rows.size());
    foldLights(query, plan.rows);
    const auto rowEnd = static_cast<uint32_t>(plan.rows.size());
    for (const auto& [view, weight] : blendViews(query, plan))
      ops_.push_back({target_, view, weight, rowBegin, rowEnd});
  }

  // Adds a row: all lights of the query, each spread over its nearest captured lights.
  void foldLights(size_t query, std::vector<LightWeight>& rows) {
    lightSieve_.lookFrom(p0_.raw());
    if (lightBlending_.foreshortened) faceLights(batch_.surfels[query]);
    for (size_t l = 0; l < batch_.lights; ++l) {
      const size_t entry = query * batch_.lights + l;
      const auto& towards = batch_.towardsLight[entry];
      const BlendSet blend = blendLights(towards, uncoveredOf(l));
      const float factor = foreshorteningOf(blend, towards);
      for (const auto& [light, weight] : blend) {
        addTo(light) =
            row_[light] + factor * weight * irradianceRatio(batch_.irradiance[entry], rigIrradiance_[light]);
        lightBlend_ = lightBlend_ + weight / static_cast<float>(targets()) * lightColor_[light];
      }
    }
    for (size_t e = 0; e < batch_.environments.size(); ++e) foldEnvironment(query, e);
    takeRow(rows);
  }

  // The row's entry for a light, which takeRow will take.
  Rgb& addTo(uint32_t light) {
    inRow_[light / 64] |= uint64_t{1} << light % 64;
    return row_[light];
  }
  void takeRow(std::vector<LightWeight>& rows) {
    for (uint32_t word = 0; word < inRow_.size(); ++word)
      for (uint64_t& bits = inRow_[word]; bits != 0; bits &= bits - 1) {
        const auto light = 64 * word + static_cast<uint32_t>(std::countr_zero(bits));
        if (row_[light] != Rgb{}) rows.push_back({light, row_[light]});
        row_[light] = {};
      }
  }

  void faceLights(uint32_t surfel) {
    faceAll();
    normal_ = assume<Normal3<AcquisitionSpace>>(rotationOf<float>(model_.cloud.r0[surfel]).col(2));
    for (size_t light = 0; light < cosine_.size(); ++light)
      cosine_[light] = foreshortenedCosine(normal_, towardsRigLight_[light]);
  }

  // By the linearity of light: what falls from around each captured light, as a share of the row.
  void foldEnvironment(size_t query, size_t e) {
    const QueryEnvironment& environment = batch_.environments[e];
    const auto& acquisitionFromEnvironment = turnOf(query, e);
    std::ranges::fill(share_, Eigen::Array4f::Zero());
    if (environment.table) faceAll();
    const Foreshortened surface{normal_, cosine_};
    if (environment.table)
      environment.table->spread(environment.lights, acquisitionFromEnvironment, share_,
                                lightBlending_.foreshortened ? &surface : nullptr);
    else
      for (const auto& [from, irradiance] : environment.lights) {
        const auto towards = acquisitionFromEnvironment(from);
        const BlendSet blend = blendLights(towards, environment.uncovered);
        const float factor = foreshorteningOf(blend, towards);
        const Rgb scaled = factor * irradiance;
        for (const auto& [light, weight] : blend)
          share_[light] += weight * Eigen::Array4f(scaled.r, scaled.g, scaled.b, brightness(irradiance));
      }
    for (uint32_t light = 0; light < row_.size(); ++light) {
      if (share_[light][3] == 0) continue; // also where the environment is dark, and nothing a share of it
      const Rgb share{share_[light][0], share_[light][1], share_[light][2]};
      addTo(light) = row_[light] + irradianceRatio(environment.strength * share, rigIrradiance_[light]);
      lightBlend_ = lightBlend_ + blendShare(share_[light][3], e) * lightColor_[light];
    }
  }

  BlendSet blendLights(const Direction3<AcquisitionSpace>& towards, Uncovered uncovered) {
    NearestCandidates nearest(lightBlending_.lights);
    for (const uint32_t light : lightSieve_.nearest(towards, lightBlending_.lights + 1)) {
      face(light);
      nearest.offer({light, anglePenalty(towardsRigLight_[light], towards)});
    }
    return blendOfNearest(nearest, towardsRigLight_, towards, lightBlending_, coverage_,
                          options_.nearest ? Uncovered::extrapolate : uncovered);
  }

  // What the radiance under the blended lights is multiplied by.
  float foreshorteningOf(const BlendSet& blend, const Direction3<AcquisitionSpace>& towards) const {
    if (!lightBlending_.foreshortened) return 1;
    return foreshortening(foreshortenedCosine(normal_, towards), blendedCosine(blend, cosine_));
  }

  float coverage(float nearestPenalty, Uncovered uncovered) const {
    return uncovered == Uncovered::fade && !options_.nearest ? coverage_.at(nearestPenalty) : 1.f;
  }
  Uncovered uncoveredOf(size_t light) const {
    return batch_.uncovered.empty() ? Uncovered::extrapolate : batch_.uncovered[light];
  }
  const Turn<AcquisitionSpace, EnvironmentSpace, float>& turnOf(size_t query, size_t e) const {
    return batch_.acquisitionFromEnvironment[query * batch_.environments.size() + e];
  }
  // Lights and environments, which share in the colours of a query alike.
  size_t targets() const { return batch_.lights + batch_.environments.size(); }
  // Of a part of an environment's light in the colours of a query.
  float blendShare(float part, size_t e) const {
    return part / (environmentBrightness_[e] * static_cast<float>(targets()));
  }

  // Camera and light chosen together, by the sum of their penalties.
  void planPairs(size_t query, PlanPart& plan) {
    faceAll();
    if (!views_.rate(batch_.surfels[query], batch_.towardsView[query])) ++plan.unseen;
    for (size_t l = 0; l < batch_.lights; ++l) {
      const size_t entry = query * batch_.lights + l;
      const float covered = ratePairs(batch_.towardsLight[entry], uncoveredOf(l));
      for (const auto& [pair, weight] : blendPairs()) {
        const auto [view, column, light] = placeOf(pair);
        const auto row = static_cast<uint32_t>(plan.rows.size());
        plan.rows.push_back(
            {column, covered * irradianceRatio(batch_.irradiance[entry], rigIrradiance_[light])});
        // Each pair is an operation of its own.
        ops_.push_back({target_ + l, view, weight, row, row + 1});
        const float share = weight / static_cast<float>(targets());
        cameraBlend_ = cameraBlend_ + share * viewColor_[view];
        lightBlend_ = lightBlend_ + covered * share * lightColor_[light];
      }
    }
    for (size_t e = 0; e < batch_.environments.size(); ++e) planEnvironmentPairs(query, e, plan);
  }

  // The pairs of all the environment's lights; those of one view are one operation.
  void planEnvironmentPairs(size_t query, size_t e, PlanPart& plan) {
    const QueryEnvironment& environment = batch_.environments[e];
    const auto& acquisitionFromEnvironment = turnOf(query, e);
    pairShare_.assign(pairs_, Rgb{});
    for (const auto& [towards, irradiance] : environment.lights) {
      const float covered = ratePairs(acquisitionFromEnvironment(towards), environment.uncovered);
      for (const auto& [pair, weight] : blendPairs())
        pairShare_[pair] = pairShare_[pair] + covered * weight * irradiance;
    }
    for (uint32_t view = 0; view < model_.columns.size(); ++view) {
      const auto& lights = model_.columns[view];
      float brightnessOfView = 0;
      for (size_t column = 0; column < lights.size(); ++column)
        brightnessOfView += brightness(pairShare_[firstPair_[view] + column]);
      if (!(brightnessOfView > 0)) continue;
      const float weight = brightnessOfView / environmentBrightness_[e];
      const auto rowBegin = static_cast<uint32_t>(plan.rows.size());
      for (uint32_t column = 0; column < lights.size(); ++column) {
        const Rgb share = pairShare_[firstPair_[view] + column];
        if (share == Rgb{}) continue;
        plan.rows.push_back(
            {column,
             1 / weight * irradianceRatio(environment.strength * share, rigIrradiance_[lights[column]])});
        lightBlend_ = lightBlend_ + blendShare(brightness(share), e) * lightColor_[lights[column]];
      }
      ops_.push_back(
          {target_ + batch_.lights + e, view, weight, rowBegin, static_cast<uint32_t>(plan.rows.size())});
      cameraBlend_ = cameraBlend_ + blendShare(brightnessOfView, e) * viewColor_[view];
    }
  }

  // Penalties of the rig's lights for a direction, and its coverage.
  float ratePairs(const Direction3<AcquisitionSpace>& towards, Uncovered uncovered) {
    float smallest = std::numeric_limits<float>::infinity();
    for (size_t light = 0; light < towardsRigLight_.size(); ++light) {
      lightPenalty_[light] = anglePenalty(towardsRigLight_[light], towards);
      smallest = std::min(smallest, lightPenalty_[light]);
    }
    return coverage(smallest, uncovered);
  }

  BlendSet blendPairs() const {
    NearestCandidates nearest(blended(options_.pairs));
    for (size_t view = 0; view < model_.columns.size(); ++view) {
      const auto& lights = model_.columns[view];
      for (size_t column = 0; column < lights.size(); ++column)
        nearest.offer({static_cast<uint32_t>(firstPair_[view] + column),
                       views_.with(view, lightPenalty_[lights[column]])});
    }
    return ulrWeights(nearest);
  }

  struct Pair {
    uint32_t view, column, light;
  };
  Pair placeOf(uint32_t pair) const {
    const auto next = std::ranges::upper_bound(firstPair_, size_t{pair});
    const auto view = static_cast<uint32_t>(next - firstPair_.begin() - 1);
    const auto column = static_cast<uint32_t>(pair - firstPair_[view]);
    return {view, column, model_.columns[view][column]};
  }

  const Model& model_;
  const LightCoverage& coverage_;
  const QueryBatch& batch_;
  const ShadeOptions& options_;
  ViewPenalties views_; // of the current query
  LightBlend lightBlending_;
  CandidateSieve lightSieve_;
  std::vector<Rgb> viewColor_, lightColor_;
  std::vector<Direction3<AcquisitionSpace>> towardsRigLight_; // from the current query
  std::vector<Rgb> rigIrradiance_;                            // there
  std::vector<size_t> facedFrom_;   // per light of the rig: the query that the last two are of
  std::vector<float> lightPenalty_; // per light of the rig, of the current direction
  std::vector<size_t> firstPair_;   // per view; the pairs of a view are its columns
  size_t pairs_ = 0;
  std::vector<float> environmentBrightness_;
  std::vector<Rgb> row_; // per light; those that are not 0 have their bit in inRow_
  std::vector<uint64_t> inRow_;
  std::vector<Eigen::Array4f> share_; // per light: what it takes over of an environment, see LightTable
  std::vector<float> cosine_;         // per light, to normal_; where light is foreshortened
  std::vector<Rgb> pairShare_;        // per pair, what it takes over
  std::vector<PlannedOp> ops_;
  size_t query_ = 0, target_ = 0;
  Point3<AcquisitionSpace, double> p0_;
  Normal3<AcquisitionSpace> normal_;
  Rgb cameraBlend_, lightBlend_;
};

} // namespace

Rgb irradianceRatio(Rgb now, Rgb captured) {
  const auto divide = [](float a, float b) { return b > 0 ? a / b : 0; };
  return {divide(now.r, captured.r), divide(now.g, captured.g), divide(now.b, captured.b)};
}

LightBlend lightBlend(const Model& model, const ShadeOptions& options) {
  if (options.nearest) return {1, LightFit::mean};
  return {options.lights.value_or(model.lightBlend.lights), options.lightFit.value_or(model.lightBlend.fit),
          options.foreshortened.value_or(model.lightBlend.foreshortened)};
}

double lightSpacing(const Model& model) {
  return LightCoverage(lightDirections(model, middleOf(model.cloud.p0))).spacing();
}

std::optional<LightTable> lightTable(const Model& model, const ShadeOptions& options, Uncovered uncovered) {
  if (!model.isFullProduct || !std::ranges::all_of(model.rig.lights, isDirectional)) return std::nullopt;
  return LightTable(lightDirections(model, middleOf(model.cloud.p0)), lightBlend(model, options),
                    options.nearest ? Uncovered::extrapolate : uncovered);
}

struct ShadingPlanner::Parts {
  const Model& model;
  const QueryBatch& batch;
  ShadeOptions options;
  Point3<AcquisitionSpace, double> middle;
  LightCoverage coverage;
  tbb::enumerable_thread_specific<Planner> planners{
      [this] { return Planner(model, middle, coverage, batch, options); }};
  std::vector<PlanPart> parts = {};
  ShadingPlan plan = {};
};

ShadingPlanner::ShadingPlanner(const Model& model, const QueryBatch& batch, const ShadeOptions& options) {
  assert(batch.towardsView.size() == batch.size());
  assert(batch.towardsLight.size() == batch.size() * batch.lights &&
         batch.irradiance.size() == batch.towardsLight.size());
  assert(batch.uncovered.empty() || batch.uncovered.size() == batch.lights);
  assert(batch.acquisitionFromEnvironment.size() == batch.size() * batch.environments.size());
  const size_t lights = batch.lights + batch.environments.size();
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
  const auto middle = middleOf(model.cloud.p0);
  parts_ = std::unique_ptr<Parts>(
      new Parts{model, batch, options, middle, LightCoverage(lightDirections(model, middle))});
  parts_->plan.targetsPerQuery = model.rig.lights.empty() || model.isFullProduct ? 1 : lights;
}

ShadingPlanner::~ShadingPlanner() = default;

size_t ShadingPlanner::targetsPerQuery() const { return parts_->plan.targetsPerQuery; }

const ShadingPlan& ShadingPlanner::plan(size_t begin, size_t end, const Progress& progress) {
  ShadingPlan& plan = parts_->plan;
  plan.queries = end - begin;
  plan.cameraBlend.resize(plan.queries);
  plan.lightBlend.resize(plan.queries);
  const size_t tasks = (plan.queries + kQueriesPerTask - 1) / kQueriesPerTask;
  std::vector<PlanPart>& parts = parts_->parts;
  if (parts.size() < tasks) parts.resize(tasks);
  tbb::parallel_for(size_t{0}, tasks, [&](size_t task) {
    progress.checkpoint();
    Planner& planner = parts_->planners.local();
    parts[task].clear();
    const size_t last = std::min(end, begin + (task + 1) * kQueriesPerTask);
    for (size_t query = begin + task * kQueriesPerTask; query < last; ++query) {
      const size_t i = query - begin;
      planner.plan(query, i * plan.targetsPerQuery, parts[task]);
      plan.cameraBlend[i] = planner.cameraBlend();
      plan.lightBlend[i] = planner.lightBlend();
    }
  });

  plan.unseen = 0;
  std::vector<size_t> firstOp{0}, firstRow{0};
  for (size_t task = 0; task < tasks; ++task) {
    firstOp.push_back(firstOp.back() + parts[task].ops.size());
    firstRow.push_back(firstRow.back() + parts[task].rows.size());
    plan.unseen += parts[task].unseen;
  }
  if (firstRow.back() > std::numeric_limits<uint32_t>::max())
    throw Error("too many surfels and lights to be planned at once");
  plan.ops.resize(firstOp.back());
  plan.rows.resize(firstRow.back());
  tbb::parallel_for(size_t{0}, tasks, [&](size_t task) {
    const auto row = static_cast<uint32_t>(firstRow[task]);
    auto op = plan.ops.begin() + static_cast<std::ptrdiff_t>(firstOp[task]);
    for (const ShadingOp& own : parts[task].ops) {
      *op = own;
      op->rowBegin += row;
      op->rowEnd += row;
      ++op;
    }
    std::ranges::copy(parts[task].rows, plan.rows.begin() + static_cast<std::ptrdiff_t>(row));
  });
  return plan;
}

ShadingPlan planShading(const Model& model, const QueryBatch& batch, const ShadeOptions& options,
                        const Progress& progress) {
  return ShadingPlanner(model, batch, options).plan(0, batch.size(), progress);
}

} // namespace surflect
