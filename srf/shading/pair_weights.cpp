#include "srf/shading/pair_weights.h"

#include "srf/ulr/foreshortening.h"
#include "srf/ulr/light_visibility.h"
#include "srf/ulr/weight_truncation.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace surflect::shading {

namespace {

ShadeOptions withNearViews(ShadeOptions options, size_t views) {
  options.cameras = views;
  options.weightError = 0;
  return options;
}

// Nearness n of the sources: 1 up to 3/4 of the threshold penalty, then falling to 0 at it. Where all
// penalties equal the threshold, those of the nearest are 1.
float nearness(float penalty, float least, float threshold) {
  if (!(least < threshold)) return penalty <= least ? 1 : 0;
  return std::clamp(4 * (1 - penalty / threshold), 0.f, 1.f);
}

} // namespace

PairWeights::PairWeights(const ReflectanceField& field, const ulr::LightExtrapolationFade& coverage,
                         const QueryBatch& batch, const ShadeOptions& options)
    : field_(field), coverage_(coverage), batch_(batch), nearest_(options.nearest),
      weighsPairs_(options.weighsPairs() && field.isFullProduct),
      isKriging_(options.interpolation == Interpolation::kriging), scales_(scalesOf(options.interpolation)),
      foreshortened_(weighsPairs_ && lightBlend(field, options).foreshortened),
      count_(options.nearest ? 1 : options.pairs), weightError_(options.weightError),
      views_(field, batch, weighsPairs_ ? withNearViews(options, kNear) : options), lights_(field.rig.lights),
      nearLightsOf_(ulr::sourcesOf(ulr::viewpointsOf(field.rig.lights))), nearestOfLight_(batch.lights) {
  for (uint32_t view = 0; view < field.columns.size(); ++view) {
    firstPair_.push_back(pairs_.size());
    const auto& lights = field.columns[view];
    for (uint32_t column = 0; column < lights.size(); ++column) {
      pairs_.push_back({view, column, lights[column]});
    }
  }
}

void PairWeights::prepare(size_t begin, size_t count) {
  begin_ = begin;
  if (!weighsPairs_) return;
  views_.prepare(begin, count);
  std::array<Point3<AcquisitionSpace>, ulr::kQueryLanes> places;
  for (size_t lane = 0; lane < count; ++lane) places[lane] = field_.cloud.p0[batch_.surfels[begin + lane]];
  nearLightsOf_.setPlaces({places.data(), count});
  std::array<Direction3<AcquisitionSpace>, ulr::kQueryLanes> towards;
  for (size_t l = 0; l < batch_.lights; ++l) {
    for (size_t lane = 0; lane < count; ++lane)
      towards[lane] = batch_.towardsLight[(begin + lane) * batch_.lights + l];
    nearLightsOf_.blend({towards.data(), count}, kNear, nearestOfLight_[l]);
  }
}

BestView PairWeights::select(size_t lane) {
  lane_ = lane;
  query_ = begin_ + lane;
  surfel_ = batch_.surfels[query_];
  lights_.moveTo(field_.cloud.p0[surfel_].cast<double>());
  lights_.evaluateAll();
  normal_ = assume<Normal3<AcquisitionSpace>>(rotationOf<float>(field_.cloud.r0[surfel_]).col(2));
  if (!weighsPairs_) return views_.computePenalties(query_);
  const auto [views, best] = views_.nearest(lane);
  setNearViews(views, best);
  return best;
}

void PairWeights::setNearViews(const ulr::NearestCandidates& nearest, const BestView& best) {
  nearViews_.size = 0;
  const auto sorted = nearest.sorted();
  if (sorted.empty()) return;
  const auto visibility = field_.visibility.of(surfel_);
  const float threshold = ulr::thresholdPenalty(sorted, kNear);
  for (const auto& [view, penalty] : sorted.first(std::min(kNear, sorted.size()))) {
    const auto towards = views_.towards(view, query_);
    float trust = ulr::VisibilityWeights::decode(visibility[view]);
    if (best.penalty > ulr::kFallbackFrom) { // the view may be a fallback
      const float angle = ulr::anglePenalty(towards, batch_.towardsView[query_]);
      trust = std::max(trust, ulr::fallbackConfidence(angle, penalty));
    }
    nearViews_.add(view, towards, trust * nearness(penalty, sorted[0].penalty, threshold));
  }
}

void PairWeights::setNearLights(const ulr::NearestCandidates& nearest, bool usesShadows) {
  nearLights_.size = 0;
  const auto sorted = nearest.sorted();
  const float threshold = ulr::thresholdPenalty(sorted, kNear);
  for (const auto& [light, penalty] : sorted.first(std::min(kNear, sorted.size())))
    nearLights_.add(light, lights_.towards(light), nearness(penalty, sorted[0].penalty, threshold),
                    usesShadows ? reachedBy(light) : 1);
}

ulr::NearestCandidates PairWeights::nearestLights(const Direction3<AcquisitionSpace>& towards) const {
  ulr::NearestCandidates nearest(kNear);
  for (uint32_t light = 0; light < lights_.size(); ++light)
    nearest.offer({light, ulr::anglePenalty(lights_.towards(light), towards)});
  return nearest;
}

// Pairs by the sum of the penalties of view and light.
ulr::BlendSet PairWeights::separateBlend(const Direction3<AcquisitionSpace>& towards) const {
  ulr::NearestCandidates nearest(count_);
  for (uint32_t number = 0; number < pairs_.size(); ++number) {
    const auto& [view, column, light] = pairs_[number];
    nearest.offer({number, views_.penalty(view, ulr::anglePenalty(lights_.towards(light), towards))});
  }
  return ulr::ulrWeights(nearest);
}

// As squaredDistance of pairPlaces, within 1e-6 / sigma_h^2 (2e-5 / sigma_h^2 near opposite directions): what
// depends on the view or the light alone is computed once, and half vectors by
//   |h - g|^2 = |h|^2 + |g|^2 - 2 h . g,   h = (l + v) / m,   |l + v|^2 = 2 + 2 l . v
std::array<float, PairWeights::kNear * PairWeights::kNear>
PairWeights::squaredDistances(const LightQuery& asked) const {
  const Vec3<float> light = asked.towards.raw(), view = batch_.towardsView[query_].raw(),
                    half = ulr::halfVector(light, view);
  const auto square = [](float x) { return x * x; };
  const float ofHalf = 1 / square(scales_.half), ofLight = 1 / square(scales_.light),
              ofView = 1 / square(scales_.view), ofShadow = 1 / square(scales_.shadow);
  const float halfSquared = half.squaredNorm(), reached = asked.reached.value_or(1);
  std::array<float, kNear> x, y, z, alongHalf, own; // lights; `own` is what they add to the distance alone
  for (size_t l = 0; l < kNear; ++l) {
    const Vec3<float> towards = nearLights_.towards[std::min(l, nearLights_.size - 1)].raw();
    x[l] = towards[0], y[l] = towards[1], z[l] = towards[2];
    alongHalf[l] = towards.dot(half);
    own[l] = ofLight * (towards - light).squaredNorm() +
             ofShadow * square(nearLights_.reached[std::min(l, nearLights_.size - 1)] - reached);
  }
  std::array<float, kNear * kNear> squared;
  for (size_t v = 0; v < nearViews_.size; ++v) {
    const Vec3<float> towards = nearViews_.towards[v].raw();
    const float viewAlongHalf = towards.dot(half), ofThis = ofView * (towards - view).squaredNorm();
    for (size_t l = 0; l < kNear; ++l) { // arithmetic without branches
      const float sum = std::max(0.f, 2 + 2 * (x[l] * towards[0] + y[l] * towards[1] + z[l] * towards[2]));
      const float inverse = 1 / std::max(std::sqrt(sum), ulr::kOppositeHalf);
      const float apart =
          sum * inverse * inverse + halfSquared - 2 * (alongHalf[l] + viewAlongHalf) * inverse;
      squared[kNear * v + l] = ofHalf * std::max(0.f, apart) + own[l] + ofThis;
    }
  }
  return squared;
}

// Pairs of the nearest views and lights, by their distance from the requested pair. A pair leaves the blend
// as its distance grows, or as the confidence in its view or light falls.
ulr::BlendSet PairWeights::nearBlend(const LightQuery& asked) const {
  if (nearViews_.size == 0) return {};
  std::array<float, kNear* kNear> penalties = squaredDistances(asked);
  for (float& penalty : std::span(penalties).first(kNear * nearViews_.size))
    penalty = isKriging_ ? std::sqrt(penalty) : penalty / 2;
  const auto confidenceOf = [&](size_t pair) {
    return nearViews_.confidence[pair / kNear] * nearLights_.confidence[pair % kNear];
  };
  const auto numberOf = [&](size_t pair) { // every view has every light
    return static_cast<uint32_t>(firstPair_[nearViews_.index[pair / kNear]]) +
           nearLights_.index[pair % kNear];
  };
  ulr::NearestCandidates nearest(count_);
  for (size_t v = 0; v < nearViews_.size; ++v)
    for (size_t l = 0; l < nearLights_.size; ++l) {
      const size_t pair = kNear * v + l;
      const float penalty = penalties[pair] / confidenceOf(pair);
      nearest.offer({static_cast<uint32_t>(pair), penalty});
    }
  ulr::BlendSet weights;
  if (isKriging_) {
    const auto sorted = nearest.sorted();
    const size_t count = std::min(count_, sorted.size());
    const float threshold =
        sorted.size() > count ? sorted[count].penalty : std::numeric_limits<float>::infinity();
    std::array<ulr::KrigingSample, ulr::kMaxBlended> samples;
    for (size_t i = 0; i < count; ++i) {
      const auto& [pair, distance] = sorted[i];
      samples[i] = {pair,
                    ulr::pairPlace(nearLights_.towards[pair % kNear], nearViews_.towards[pair / kNear],
                                   nearLights_.reached[pair % kNear], scales_),
                    ulr::nuggetOf(threshold > 0 ? distance / threshold : 0, confidenceOf(pair))};
    }
    weights =
        ulr::krigingWeights({samples.data(), count}, ulr::pairPlace(asked.towards, batch_.towardsView[query_],
                                                                    asked.reached.value_or(1), scales_));
  } else {
    weights = ulr::ulrWeights(nearest);
  }
  for (ulr::Blended& blended : weights) blended.index = numberOf(blended.index);
  return weights;
}

// Foreshortening f of a blend. A light that does not reach the surfel has no cosine, so that lit photographs
// also answer for shadow where there are no others.
float PairWeights::foreshorteningOf(const ulr::BlendSet& blend, const LightQuery& asked) const {
  float blended = 0;
  for (const auto& [number, weight] : blend) {
    const uint32_t light = pairs_[number].light;
    blended += weight * ulr::foreshortenedCosine(normal_, lights_.towards(light)) *
               (asked.reached ? reachedBy(light) : 1);
  }
  return ulr::foreshortening(asked.reached.value_or(1) * ulr::foreshortenedCosine(normal_, asked.towards),
                             blended);
}

PairWeights::Blend PairWeights::blendOf(const LightQuery& asked,
                                        const ulr::NearestCandidates& nearestLights) {
  if (nearestLights.sorted().empty()) return {};
  Blend blend;
  if (!weighsPairs_) {
    blend.weights = separateBlend(asked.towards);
  } else {
    setNearLights(nearestLights, asked.reached.has_value());
    blend.weights = nearBlend(asked);
  }
  ulr::truncate(blend.weights, weightError_);
  std::ranges::sort(blend.weights, {}, &ulr::Blended::index);
  if (asked.extrapolation == ulr::LightExtrapolation::fade && !nearest_)
    blend.scale = coverage_.at(nearestLights.sorted()[0].penalty);
  if (foreshortened_) blend.scale *= foreshorteningOf(blend.weights, asked);
  return blend;
}

PairWeights::Blend PairWeights::blend(size_t l) {
  const size_t entry = query_ * batch_.lights + l;
  const LightQuery asked{batch_.towardsLight[entry], batch_.extrapolationOf(l),
                         batch_.reached.empty() ? std::nullopt : std::optional(batch_.reached[entry])};
  if (!weighsPairs_ || !nearestOfLight_[l].isPrecise(lane_))
    return blendOf(asked, nearestLights(asked.towards));
  return blendOf(asked, nearestOfLight_[l].candidates(lane_));
}

PairWeights::Blend PairWeights::blendTowards(const Direction3<AcquisitionSpace>& towards,
                                             ulr::LightExtrapolation extrapolation) {
  return blendOf({towards, extrapolation, {}}, nearestLights(towards));
}

} // namespace surflect::shading
