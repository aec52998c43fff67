#include "srf/shading/plan.h"

#include "srf/shading/taps.h"
#include "srf/weights/camera_weights.h"
#include "srf/weights/light_weights.h"
#include "srf/weights/pair_weights.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"

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
  // The field must outlive the emitter.
  explicit Emitter(const weights::ReflectanceField& field) : alpha_(field.alpha), files_(field.files) {
    for (const capture::View& view : field.rig.views) projectors_.emplace_back(view.camera);
  }

  // Adds a look-up of `place` in a view for a target, under the light row [begin, end), and the view's alpha
  // to that of the target. Does nothing if the place does not project into the view.
  void emit(const Point3<AcquisitionSpace, double>& place, size_t target, uint32_t view, float weight,
            size_t begin, size_t end, ShadingPlan& plan) const {
    const auto pixel = projectors_[view](place);
    if (!pixel) return;
    const auto x = static_cast<float>(pixel->x), y = static_cast<float>(pixel->y);
    if (!plan.alphaSums.empty()) {
      ShadingPlan::AlphaSum& sum = plan.alphaSums[target];
      sum.weight += weight;
      weight *= alpha_[view].at(x, y);
      sum.alpha += weight;
      if (weight == 0) return;
    }
    plan.ops.push_back({static_cast<uint32_t>(target), view, x, y, weight, static_cast<uint32_t>(begin),
                        static_cast<uint32_t>(end)});
  }

  // Whether a view shows the object at a place: projects it to a texel in a stored block. Views without a
  // file show it wherever it projects.
  bool isShown(const Point3<AcquisitionSpace, double>& place, uint32_t view) const {
    const auto pixel = projectors_[view](place);
    if (!pixel || files_.empty()) return pixel.has_value();
    return storesTexel(files_[view], static_cast<float>(pixel->x), static_cast<float>(pixel->y));
  }

private:
  std::span<const codec::AlphaPlane> alpha_;                     // one for each view, or none
  std::span<const codec::ViewFile> files_;                       // likewise
  std::vector<capture::Projector<AcquisitionSpace>> projectors_; // one for each view
};

// Plans cameras and lights with separate weights: one operation for each query and camera.
class ProductPlanner {
public:
  // For all lights, a query has one target; for environments alone, it is the first after those of the
  // lights.
  ProductPlanner(const weights::ReflectanceField& field, const weights::LightExtrapolationFade& coverage,
                 const weights::QueryBatch& batch, const weights::ShadeOptions& options,
                 weights::LightSources sources)
      : field_(field), batch_(batch), isWhole_(sources == weights::LightSources::all),
        share_(isWhole_
                   ? 1
                   : static_cast<float>(batch.environments.size()) / static_cast<float>(batch.sources())),
        cameras_(field, batch, options), lights_(field, coverage, batch, options, sources), emitter_(field),
        viewColor_(weights::blendColors(field.rig.views.size())) {}

  void plan(size_t begin, size_t end, ShadingPlan& plan) {
    const bool isLit = !field_.rig.lights.empty(), showsBlends = !plan.cameraBlend.empty();
    const size_t firstPlace = batch_.placeBegin(begin);
    for (size_t first = begin; first < end; first += weights::kQueryLanes) {
      const size_t count = std::min(weights::kQueryLanes, end - first);
      if (isLit) lights_.prepare(first, count, plan.rows);
      cameras_.prepare(first, count);
      for (size_t lane = 0; lane < count; ++lane) {
        const size_t placeBegin = batch_.placeBegin(first + lane),
                     placeEnd = batch_.placeBegin(first + lane + 1);
        const weights::LightWeights::Row row =
            isLit ? lights_.append(lane, plan.rows) : fixedLight(plan.rows);
        const float share = share_ * (colorScales_.empty() ? 1 : colorScales_[first + lane - firstQuery_]);
        const weights::BestView best = cameras_.forEach(lane, [&](uint32_t view, float weight) {
          for (size_t place = placeBegin; place < placeEnd; ++place) {
            const size_t i = place - firstPlace;
            emitter_.emit(field_.cloud.p0[batch_.placeAt(place)].cast<double>(),
                          i * plan.targetsPerPlace + (isWhole_ ? 0 : batch_.lights), view, weight, row.begin,
                          row.end, plan);
            if (showsBlends) plan.cameraBlend[i] = plan.cameraBlend[i] + share * weight * viewColor_[view];
          }
        });
        for (size_t i = placeBegin - firstPlace; i < placeEnd - firstPlace; ++i) {
          if (isLit && showsBlends)
            plan.lightBlend[i] = plan.lightBlend[i] + share / share_ * lights_.blendColor();
          if (!isWhole_) continue; // known from the lights
          plan.confidence[i] = weights::confidenceOf(best.penalty);
          if (!best.isSeen) ++plan.unseen;
        }
      }
    }
  }

  // Replaces the batch's irradiance from a query on (#lights a query), and scales the blend colours of each
  // query; both must outlive the next plan.
  void answerRest(std::span<const Rgb> irradiance, std::span<const float> colorScales, size_t firstQuery) {
    lights_.setIrradiance(irradiance, firstQuery);
    colorScales_ = colorScales;
    firstQuery_ = firstQuery;
  }

private:
  // Row of a capture under fixed illumination: its only column, unchanged.
  static weights::LightWeights::Row fixedLight(weights::LightRows& rows) {
    rows.add(0, {1, 1, 1});
    return {rows.lights.size() - 1, rows.lights.size()};
  }

  const weights::ReflectanceField& field_;
  const weights::QueryBatch& batch_;
  const bool isWhole_;
  const float share_;                  // of the query's lights
  std::span<const float> colorScales_; // empty: 1
  size_t firstQuery_ = 0;
  weights::CameraWeights cameras_;
  weights::LightWeights lights_;
  Emitter emitter_;
  std::vector<Rgb> viewColor_;
};

// Plans (camera, light) pairs: one operation for each light or environment and view.
class PairPlanner {
public:
  PairPlanner(const weights::ReflectanceField& field, const weights::LightExtrapolationFade& coverage,
              const weights::QueryBatch& batch, const weights::ShadeOptions& options)
      : field_(field), batch_(batch), pairs_(field, coverage, batch, options), emitter_(field),
        viewColor_(weights::blendColors(field.rig.views.size())),
        lightColor_(weights::blendColors(field.rig.lights.size())),
        environmentBrightness_(weights::environmentBrightness(batch)) {
    isSeparate_ = field.isFullProduct && isSeparateBesideTables(field, options);
    if (isSeparate_ || (field.isFullProduct && !batch.environments.empty()))
      product_.emplace(field, coverage, batch, options,
                       isSeparate_ ? weights::LightSources::all : weights::LightSources::environments);
  }

  void plan(size_t begin, size_t end, ShadingPlan& plan) {
    firstPlace_ = batch_.placeBegin(begin);
    rest_.clear();
    restShares_.clear();
    for (size_t first = begin; first < end; first += weights::kQueryLanes) {
      const size_t count = std::min(weights::kQueryLanes, end - first);
      pairs_.prepare(first, count);
      for (size_t lane = 0; lane < count; ++lane) planQuery(first + lane, pairs_.select(lane), plan);
    }
    if (isSeparate_) product_->answerRest(rest_, restShares_, begin);
    if (product_) product_->plan(begin, end, plan);
  }

private:
  void planQuery(size_t query, const weights::BestView& best, ShadingPlan& plan) {
    cameraColor_ = lightBlendColor_ = {};
    float restShare = static_cast<float>(batch_.environments.size());
    for (size_t l = 0; l < batch_.lights; ++l) restShare += 1 - planLight(query, l, plan);
    if (isSeparate_) restShares_.push_back(restShare / static_cast<float>(batch_.sources()));
    if (!product_)
      for (size_t e = 0; e < batch_.environments.size(); ++e) planEnvironment(query, e, plan);
    for (size_t i = batch_.placeBegin(query) - firstPlace_; i < batch_.placeBegin(query + 1) - firstPlace_;
         ++i) {
      plan.confidence[i] = weights::confidenceOf(best.penalty);
      if (!best.isSeen && !isSeparate_) ++plan.unseen; // the product counts, too
      if (plan.cameraBlend.empty()) continue;
      plan.cameraBlend[i] = cameraColor_;
      plan.lightBlend[i] = lightBlendColor_;
    }
  }

  // Looks up all places of a query for one of its lights or environments.
  void emitAll(size_t query, size_t source, uint32_t view, float weight, size_t rowBegin, size_t rowEnd,
               ShadingPlan& plan) {
    for (size_t place = batch_.placeBegin(query); place < batch_.placeBegin(query + 1); ++place)
      emitter_.emit(field_.cloud.p0[batch_.placeAt(place)].cast<double>(),
                    (place - firstPlace_) * plan.targetsPerPlace + source, view, weight, rowBegin, rowEnd,
                    plan);
  }

  // Plans the tables' share of a light, and the rest unless the product answers it. Returns that share.
  float planLight(size_t query, size_t l, ShadingPlan& plan) {
    pairs_.setLight(l);
    const auto shared = pairs_.shared();
    const float share = shared ? shared->share : 0;
    if (shared) planShared(query, l, *shared, plan);
    if (isSeparate_)
      rest_.push_back((1 - share) * batch_.irradiance[query * batch_.lights + l]);
    else if (share < 1)
      planPairs(query, l, 1 - share, plan);
    return share;
  }

  // Plans a share of a light; the pairs of one view become one operation.
  void planPairs(size_t query, size_t l, float share, ShadingPlan& plan) {
    const Rgb irradiance = share * batch_.irradiance[query * batch_.lights + l];
    const auto [weights, scale, lacksState] = pairs_.blend();
    const weights::CapturedPairs& pairs = pairs_.pairs();
    if (lacksState) plan.unmatchedShadows += batch_.placeBegin(query + 1) - batch_.placeBegin(query);
    const auto sources = static_cast<float>(batch_.sources());
    for (auto first = weights.begin(); first != weights.end();) {
      const uint32_t view = pairs[first->index].view;
      const auto last = std::find_if(
          first, weights.end(), [&](const weights::Blended& pair) { return pairs[pair.index].view != view; });
      float ofView = 0;
      for (auto pair = first; pair != last; ++pair) ofView += pair->weight;
      const size_t rowBegin = plan.rows.lights.size();
      for (auto pair = first; pair != last; ++pair) {
        const auto [_, column, light] = pairs[pair->index];
        plan.rows.add(column, scale * pair->weight / ofView * pairs_.ratio(irradiance, light));
        lightBlendColor_ = lightBlendColor_ + share * scale * pair->weight / sources * lightColor_[light];
      }
      emitAll(query, l, view, ofView, rowBegin, plan.rows.lights.size(), plan);
      cameraColor_ = cameraColor_ + share * ofView / sources * viewColor_[view];
      first = last;
    }
  }

  // The photographs that correct the tables: one operation each. A photograph that does not show a place
  // counts as its prediction, so that it corrects nothing there. Blend colours are those of the photographs,
  // by the size of their factors.
  void planShared(size_t query, size_t l, const weights::PairWeights::Shared& shared, ShadingPlan& plan) {
    const auto& [photographs, predicted, offset] = shared.blend;
    const Rgb& irradiance = batch_.irradiance[query * batch_.lights + l];
    const float share = shared.share * shared.fade;
    const size_t target = plan.targetsPerPlace - plan.tablesPerPlace + l;
    for (size_t place = batch_.placeBegin(query); place < batch_.placeBegin(query + 1); ++place) {
      plan.tableShares[(place - firstPlace_) * plan.tablesPerPlace + l] = shared.share;
      offsetAt(plan, place, target) =
          share * field_.shared->gains[batch_.placeAt(place)] * (irradiance * offset);
    }
    float sizes = 0;
    for (const auto& [number, factor] : photographs) sizes += std::abs(factor);
    for (size_t i = 0; i < photographs.size(); ++i) {
      const auto [number, factor] = photographs[i];
      if (factor == 0) continue;
      const auto [view, column, light] = pairs_.pairs()[number];
      const size_t row = plan.rows.lights.size();
      plan.rows.add(column, share * factor / std::abs(factor) * pairs_.ratio(irradiance, light));
      for (size_t place = batch_.placeBegin(query); place < batch_.placeBegin(query + 1); ++place) {
        const uint32_t surfel = batch_.placeAt(place);
        const auto p0 = field_.cloud.p0[surfel].cast<double>();
        if (emitter_.isShown(p0, view)) {
          emitter_.emit(p0, (place - firstPlace_) * plan.targetsPerPlace + target, view, std::abs(factor),
                        row, row + 1, plan);
        } else {
          Rgb& sum = offsetAt(plan, place, target);
          sum = sum + share * factor * field_.shared->gains[surfel] * (irradiance * predicted[i]);
        }
      }
      const float ofBlend = shared.share * std::abs(factor) / (sizes * static_cast<float>(batch_.sources()));
      cameraColor_ = cameraColor_ + ofBlend * viewColor_[view];
      lightBlendColor_ = lightBlendColor_ + ofBlend * lightColor_[light];
    }
  }

  Rgb& offsetAt(ShadingPlan& plan, size_t place, size_t target) const {
    return plan.offsets[(place - firstPlace_) * plan.targetsPerPlace + target];
  }

  // Sums the irradiance of the environment's lights that each pair represents; the pairs of one view become
  // one operation.
  void planEnvironment(size_t query, size_t e, ShadingPlan& plan) {
    const weights::QueryEnvironment& environment = batch_.environments[e];
    const auto& rotation = batch_.rotationOf(query, e);
    pairShare_.assign(pairs_.pairs().size(), Rgb{});
    for (const auto& [towards, irradiance, spread] : environment.lights) {
      const auto [weights, scale, _] = pairs_.blendTowards(rotation(towards), environment.extrapolation);
      for (const auto& [number, weight] : weights)
        pairShare_[number] = pairShare_[number] + scale * weight * irradiance;
    }
    const auto sources = static_cast<float>(batch_.sources());
    const auto colorShare = [&](float ofLight) { return ofLight / (environmentBrightness_[e] * sources); };
    for (uint32_t view = 0; view < field_.columns.size(); ++view) {
      const auto& lights = field_.columns[view];
      const std::span shares = std::span(pairShare_).subspan(pairs_.pairs().firstOf(view), lights.size());
      float brightnessOfView = 0;
      for (const Rgb& share : shares) brightnessOfView += weights::brightness(share);
      if (!(brightnessOfView > 0)) continue;
      const float weight = brightnessOfView / environmentBrightness_[e];
      const size_t rowBegin = plan.rows.lights.size();
      for (uint32_t column = 0; column < lights.size(); ++column) {
        const Rgb share = shares[column];
        if (share == Rgb{}) continue;
        plan.rows.add(column, 1 / weight *
                                  weights::irradianceRatio(environment.strength * share,
                                                           pairs_.irradiance(lights[column])));
        lightBlendColor_ =
            lightBlendColor_ + colorShare(weights::brightness(share)) * lightColor_[lights[column]];
      }
      emitAll(query, batch_.lights + e, view, weight, rowBegin, plan.rows.lights.size(), plan);
      cameraColor_ = cameraColor_ + colorShare(brightnessOfView) * viewColor_[view];
    }
  }

  const weights::ReflectanceField& field_;
  const weights::QueryBatch& batch_;
  weights::PairWeights pairs_;
  // Cameras and lights apart: of environments, if every camera has every light, or of all that tables leave.
  std::optional<ProductPlanner> product_;
  bool isSeparate_ = false; // the product answers lights where tables do not
  // The rest that tables leave, of each planned query: irradiance of each light, and mean share of all
  // sources.
  std::vector<Rgb> rest_;
  std::vector<float> restShares_;
  Emitter emitter_;
  std::vector<Rgb> viewColor_, lightColor_;
  std::vector<float> environmentBrightness_;
  Rgb cameraColor_, lightBlendColor_; // blend colours of the current query
  size_t firstPlace_ = 0;             // of the plan
  std::vector<Rgb> pairShare_;        // per pair: share of the current environment's irradiance
};

using Planner = std::variant<ProductPlanner, PairPlanner>;

void requireLights(const weights::ReflectanceField& field, const weights::QueryBatch& batch,
                   const weights::ShadeOptions& options) {
  const bool isFixed = field.rig.lights.empty();
  if (isFixed && batch.sources() > 0)
    throw Error("captured under fixed illumination: it cannot be lit by a light of the script")
        .in(field.folder);
  if (!isFixed && batch.sources() == 0)
    throw Error("captured under " + counted(field.rig.lights.size(), "light") +
                ": the script, or the photographs to compare with, must name a light; `evaluate --script` "
                "takes one with [[light]]")
        .in(field.folder);
  if (interpolationOf(field, options) == weights::Interpolation::shared && !isFixed && !field.shared)
    throw Error::mismatch(
        "a model with tables",
        "none: pack its capture again with --tables on, opaque and with at least 4 cameras and lights")
        .at("interpolation shared")
        .in(field.folder);
  if (options.foreshortened.value_or(false) &&
      (isFixed ||
       (!field.isFullProduct && (!usesKriging(field, options) || isSeparateBesideTables(field, options)))))
    throw Error::mismatch("photographs under all lights from all cameras, or --interpolation kriging",
                          isFixed ? "fixed illumination" : "pairs of cameras and lights")
        .at("foreshortening on")
        .in(field.folder);
}

} // namespace

void addOffsets(const ShadingPlan& plan, std::span<Rgb> radiance) {
  for (size_t target = 0; target < plan.offsets.size(); ++target)
    radiance[target] = reflectance::positive(radiance[target] + plan.offsets[target]);
}

void meanAlpha(ShadingPlan& plan) {
  plan.alpha.assign(plan.alphaSums.size() / plan.targetsPerPlace, 0);
  for (size_t place = 0; place < plan.alpha.size(); ++place) {
    float sum = 0, count = 0;
    for (size_t target = 0; target < plan.targetsPerPlace; ++target)
      if (const auto& [alpha, weight] = plan.alphaSums[place * plan.targetsPerPlace + target]; weight > 0) {
        sum += alpha / weight;
        ++count;
      }
    if (count > 0) plan.alpha[place] = std::clamp(sum / count, 0.f, 1.f);
  }
}

struct ShadingPlanner::Impl {
  const weights::ReflectanceField& field;
  const weights::QueryBatch& batch;
  weights::ShadeOptions options;
  weights::LightExtrapolationFade coverage{lightDirections(field)};
  bool usesAlpha = options.usesAlpha && !field.alpha.empty();
  bool isProduct =
      hasSeparateWeights(field, options) || (field.isFullProduct && batch.lights == 0); // environments alone
  bool hasTables = !isProduct && usesTables(field, options);
  size_t targetsPerPlace = (isProduct || (field.isFullProduct && isSeparateBesideTables(field, options))
                                ? 1
                                : std::max(size_t{1}, batch.sources())) +
                           (hasTables ? batch.lights : 0);
  tbb::enumerable_thread_specific<Planner> planners{[this] {
    return isProduct ? Planner(std::in_place_type<ProductPlanner>, field, coverage, batch, options,
                               weights::LightSources::all)
                     : Planner(std::in_place_type<PairPlanner>, field, coverage, batch, options);
  }};
};

ShadingPlanner::ShadingPlanner(const weights::ReflectanceField& field, const weights::QueryBatch& batch,
                               const weights::ShadeOptions& options) {
  assert(batch.towardsView.size() == batch.size());
  assert(batch.towardsLight.size() == batch.size() * batch.lights &&
         batch.irradiance.size() == batch.towardsLight.size());
  assert(batch.extrapolation.empty() || batch.extrapolation.size() == batch.lights);
  assert(batch.acquisitionFromEnvironment.size() == batch.size() * batch.environments.size());
  assert(batch.reached.empty() ||
         (field.lightVisibility && batch.reached.size() == batch.towardsLight.size()));
  requireLights(field, batch, options);
  impl_ = std::unique_ptr<Impl>(new Impl{field, batch, options});
}

ShadingPlanner::~ShadingPlanner() = default;

size_t ShadingPlanner::targetsPerPlace() const { return impl_->targetsPerPlace; }

size_t ShadingPlanner::queriesPerPlan() const {
  const size_t perQuery = targetsPerPlace() * impl_->options.placesPerQuery;
  return std::max(size_t{1}, kTargetsPerPlan / perQuery / weights::kQueryLanes) * weights::kQueryLanes;
}

void ShadingPlanner::plan(size_t begin, size_t end, ShadingPlan& plan) {
  plan.places = impl_->batch.placeBegin(end) - impl_->batch.placeBegin(begin);
  plan.targetsPerPlace = targetsPerPlace();
  plan.tablesPerPlace = impl_->hasTables ? impl_->batch.lights : 0;
  plan.ops.clear();
  plan.rows.clear();
  plan.unseen = plan.unmatchedShadows = 0;
  plan.offsets.assign(impl_->hasTables ? plan.targets() : 0, {});
  plan.tableShares.assign(plan.places * plan.tablesPerPlace, 0);
  plan.confidence.resize(plan.places);
  const size_t blends = impl_->options.showsBlends ? plan.places : 0;
  plan.alphaSums.assign(impl_->usesAlpha ? plan.targets() : 0, {});
  plan.cameraBlend.assign(blends, {});
  plan.lightBlend.assign(blends, {});
  std::visit([&](auto& planner) { planner.plan(begin, end, plan); }, impl_->planners.local());
  meanAlpha(plan);
  if (std::max({plan.rows.weights.size(), plan.rows.lights.size(), plan.targets()}) >
      std::numeric_limits<uint32_t>::max())
    throw Error("too many surfels and lights to be planned at once");
}

ShadingPlan planShading(const weights::ReflectanceField& field, const weights::QueryBatch& batch,
                        const weights::ShadeOptions& options) {
  ShadingPlan plan;
  ShadingPlanner(field, batch, options).plan(0, batch.size(), plan);
  return plan;
}

} // namespace surflect::shading
