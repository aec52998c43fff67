#include "srf/shading/pair_weights.h"

#include "srf/ulr/foreshortening.h"
#include "srf/ulr/light_visibility.h"
#include "srf/ulr/weight_truncation.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace surflect::shading {

namespace {

ShadeOptions withNearViews(ShadeOptions options, size_t views) {
  options.cameras = views;
  options.weightError = 0;
  return options;
}

// Nearness n of the sources. Where all penalties equal the threshold, those of the nearest are 1.
float nearness(float penalty, float least, float threshold) {
  if (!(least < threshold)) return penalty <= least ? 1 : 0;
  return std::clamp((1 - penalty / threshold) / (1 - kNearUpTo), 0.f, 1.f);
}

} // namespace

ulr::KrigingScales scalesOf(const ReflectanceField& field, const ShadeOptions& options, float reached) {
  if (interpolationOf(field, options) == Interpolation::pairs)
    return {.half = 0.125f, .light = 1, .view = 1, .shadow = 0.35355339f};
  constexpr ulr::KrigingScales inShadow{.half = 0.8f, .light = 1, .view = 1};
  const ulr::KrigingScales lit{.half = field.interpolation.halfScale};
  const auto between = [&](float ofShadow, float ofLight) { // 1 / scale^2 is linear in the state
    return 1 / std::sqrt((1 - reached) / (ofShadow * ofShadow) + reached / (ofLight * ofLight));
  };
  return {between(inShadow.half, lit.half), between(inShadow.light, lit.light),
          between(inShadow.view, lit.view), lit.shadow};
}

bool isReciprocal(const ReflectanceField& field, const ShadeOptions& options) {
  return weighsPairs(field, options) && interpolationOf(field, options) == Interpolation::kriging &&
         options.reciprocal.value_or(field.interpolation.reciprocal) &&
         lightBlend(field, options).foreshortened;
}

float exchangedConfidence(float cosine, float reached) {
  return reached * static_cast<float>(ulr::grazingFade(cosine));
}

PairWeights::PairWeights(const ReflectanceField& field, const ulr::LightExtrapolationFade& coverage,
                         const QueryBatch& batch, const ShadeOptions& options)
    : field_(field), coverage_(coverage), batch_(batch), options_(options), nearest_(options.nearest),
      weighsPairs_(shading::weighsPairs(field, options)), isSparse_(weighsPairs_ && !field.hasNearPairs),
      isKriging_(interpolationOf(field, options) == Interpolation::kriging),
      litScales_(scalesOf(field, options, 1)), shadowScales_(scalesOf(field, options, 0)),
      foreshortened_(weighsPairs_ && lightBlend(field, options).foreshortened),
      reciprocal_(isReciprocal(field, options)), count_(options.nearest ? 1 : pairCount(field, options)),
      weightError_(options.weightError),
      views_(field, batch, weighsPairs_ ? withNearViews(options, kNear) : options), lights_(field.rig.lights),
      nearLightsOf_(ulr::sourcesOf(ulr::viewpointsOf(field.rig.lights))), nearestOfLight_(batch.lights),
      numbers_(field.rig.views.size() * field.rig.lights.size(), kMissing),
      lightPenalties_(field.rig.lights.size()), nearOfAll_{std::vector<float>(field.rig.views.size()),
                                                           std::vector<float>(field.rig.lights.size())},
      exchangedOfAll_{nearOfAll_.lights, nearOfAll_.viewers} {
  if (reciprocal_ && !isSparse_) {
    std::vector<capture::Viewpoint<AcquisitionSpace>> viewpoints;
    for (const capture::View& view : field.rig.views) viewpoints.emplace_back(view.camera);
    for (size_t l = 0; l < batch.lights; ++l)
      viewsNearLight_.emplace_back(ulr::sourcesOf(viewpoints), field.visibility);
    nearestViewsOfLight_.resize(batch.lights);
  }
  for (uint32_t view = 0; view < field.columns.size(); ++view) {
    firstPair_.push_back(pairs_.size());
    const auto& lights = field.columns[view];
    for (uint32_t column = 0; column < lights.size(); ++column) {
      numbers_[view * field.rig.lights.size() + lights[column]] = static_cast<uint32_t>(pairs_.size());
      pairs_.push_back({view, column, lights[column]});
    }
  }
}

void PairWeights::prepare(size_t begin, size_t count) {
  begin_ = begin;
  if (!weighsPairs_ || isSparse_) return;
  views_.prepare(begin, count);
  std::array<Point3<AcquisitionSpace>, ulr::kQueryLanes> places;
  for (size_t lane = 0; lane < count; ++lane) places[lane] = field_.cloud.p0[batch_.surfels[begin + lane]];
  nearLightsOf_.setPlaces({places.data(), count});
  std::array<Direction3<AcquisitionSpace>, ulr::kQueryLanes> towards;
  for (size_t l = 0; l < batch_.lights; ++l) {
    for (size_t lane = 0; lane < count; ++lane)
      towards[lane] = batch_.towardsLight[(begin + lane) * batch_.lights + l];
    nearLightsOf_.blend({towards.data(), count}, kNear, nearestOfLight_[l]);
    if (reciprocal_)
      nearestViewsOfLight_[l] = &viewsNearLight_[l].blend(
          {batch_.surfels.data() + begin, count}, {places.data(), count}, {towards.data(), count}, kNear);
  }
  if (reciprocal_) nearLightsOf_.blend({batch_.towardsView.data() + begin, count}, kNear, nearestOfView_);
}

BestView PairWeights::select(size_t lane) {
  lane_ = lane;
  query_ = begin_ + lane;
  surfel_ = batch_.surfels[query_];
  lights_.moveTo(field_.cloud.p0[surfel_].cast<double>());
  lights_.evaluateAll();
  normal_ = assume<Normal3<AcquisitionSpace>>(rotationOf<float>(field_.cloud.r0[surfel_]).col(2));
  if (!weighsPairs_) return views_.computePenalties(query_);
  if (isSparse_) {
    const BestView best = views_.computePenalties(query_);
    setAllViews(best);
    return best;
  }
  if (!field_.isFullProduct && !batch_.environments.empty()) views_.computePenalties(query_); // blendTowards
  const auto [views, best] = views_.nearest(lane);
  setNearViews(views, best);
  return best;
}

float PairWeights::confidenceIn(uint32_t view, const Direction3<AcquisitionSpace>& towards, float penalty,
                                const BestView& best) const {
  const float seen = ulr::VisibilityWeights::decode(field_.visibility.of(surfel_)[view]);
  if (best.penalty <= ulr::kFallbackFrom) return seen;
  const float angle = ulr::anglePenalty(towards, batch_.towardsView[query_]);
  const float begun = std::min(1.f, best.penalty - ulr::kFallbackFrom); // fallbacks fade in
  return std::max(seen, begun * ulr::fallbackConfidence(angle, penalty));
}

void PairWeights::setAllViews(const BestView& best) {
  towardsViews_.clear();
  confidences_.clear();
  for (uint32_t view = 0; view < field_.rig.views.size(); ++view) {
    towardsViews_.push_back(views_.towards(view, query_));
    confidences_.push_back(confidenceIn(view, towardsViews_[view], views_.penalty(view, 0), best));
  }
}

void PairWeights::setNearViews(const ulr::NearestCandidates& nearest, const BestView& best) {
  near_.viewers.clear();
  const auto sorted = nearest.sorted();
  if (sorted.empty()) return;
  const float threshold = ulr::thresholdPenalty(sorted, kNear);
  for (const auto& [view, penalty] : sorted.first(std::min(kNear, sorted.size()))) {
    const auto towards = views_.towards(view, query_);
    near_.viewers.add(view, towards.raw(),
                      confidenceIn(view, towards, penalty, best) *
                          nearness(penalty, sorted[0].penalty, threshold));
  }
}

void PairWeights::setNearLights(const ulr::NearestCandidates& nearest, bool usesShadows) {
  near_.lights.clear();
  const auto sorted = nearest.sorted();
  const float threshold = ulr::thresholdPenalty(sorted, kNear);
  for (const auto& [light, penalty] : sorted.first(std::min(kNear, sorted.size())))
    near_.lights.add(light, lights_.towards(light).raw(), nearness(penalty, sorted[0].penalty, threshold),
                     usesShadows ? reachedBy(light) : 1);
}

// Viewers are the lights of the rig that are nearest to the requested viewer; lights are the views that are
// nearest to the l-th light of the query, which they see as lit.
void PairWeights::setExchanged(size_t l, std::optional<float> requested) {
  if (!nearestOfView_.isPrecise(lane_) || !nearestViewsOfLight_[l]->isPrecise(lane_)) return;
  const ulr::NearestCandidates lights = nearestOfView_.candidates(lane_),
                               views = nearestViewsOfLight_[l]->candidates(lane_);
  if (views.sorted().empty()) return;
  const float ofLights = ulr::thresholdPenalty(lights.sorted(), kNear),
              ofViews = ulr::thresholdPenalty(views.sorted(), kNear);
  for (const auto& [light, penalty] : lights.sorted().first(std::min(kNear, lights.sorted().size()))) {
    const auto towards = lights_.towards(light);
    exchanged_.viewers.add(light, towards.raw(),
                           nearness(penalty, lights.sorted()[0].penalty, ofLights) *
                               exchangedConfidence(ulr::foreshortenedCosine(normal_, towards),
                                                   requested ? *requested * reachedBy(light) : 1));
  }
  const auto visibility = field_.visibility.of(surfel_);
  for (const auto& [view, penalty] : views.sorted().first(std::min(kNear, views.sorted().size())))
    exchanged_.lights.add(view, views_.towards(view, query_).raw(),
                          nearness(penalty, views.sorted()[0].penalty, ofViews) *
                              ulr::VisibilityWeights::decode(visibility[view]));
}

ulr::KrigingScales PairWeights::scalesFor(const LightQuery& asked) const {
  const float reached = asked.reached.value_or(1);
  if (reached <= 0) return shadowScales_;
  return reached >= 1 ? litScales_ : scalesOf(field_, options_, reached);
}

ulr::NearestCandidates PairWeights::nearestLights(const Direction3<AcquisitionSpace>& towards) {
  ulr::NearestCandidates nearest(kNear);
  for (uint32_t light = 0; light < lights_.size(); ++light) {
    lightPenalties_[light] = ulr::anglePenalty(lights_.towards(light), towards);
    nearest.offer({light, lightPenalties_[light]});
  }
  return nearest;
}

// Pairs by the sum of the penalties of view and light.
ulr::BlendSet PairWeights::separateBlend() const {
  ulr::NearestCandidates nearest(count_);
  for (uint32_t view = 0; view < field_.columns.size(); ++view) {
    if (!(views_.penalty(view, 0) < nearest.worst())) continue; // no light makes its penalty less
    for (size_t column = 0; column < field_.columns[view].size(); ++column)
      nearest.offer({static_cast<uint32_t>(firstPair_[view] + column),
                     views_.penalty(view, lightPenalties_[field_.columns[view][column]])});
  }
  return ulr::ulrWeights(nearest);
}

RequestedPair PairWeights::requestedPair(const LightQuery& asked, const ulr::KrigingScales& scales) const {
  const Vec3<float>& light = asked.towards.raw();
  const Vec3<float>& view = batch_.towardsView[query_].raw();
  const Vec3<float> half = ulr::halfVector(light, view);
  const auto inverseSquare = [](float scale) { return 1 / (scale * scale); };
  return {.light = {light[0], light[1], light[2]},
          .view = {view[0], view[1], view[2]},
          .half = {half[0], half[1], half[2]},
          .shadow = asked.reached.value_or(1),
          .ofHalf = inverseSquare(scales.half),
          .ofLight = inverseSquare(scales.light),
          .ofView = inverseSquare(scales.view),
          .ofShadow = 1 / scales.shadow,
          .isKriging = isKriging_};
}

// A pair leaves the blend as its distance grows, or as the confidence in its view or light falls.
template <class CandidateAt>
ulr::BlendSet PairWeights::weightsOf(const ulr::NearestCandidates& nearest, const LightQuery& asked,
                                     const ulr::KrigingScales& scales, const CandidateAt& candidateAt) const {
  if (!isKriging_) {
    ulr::BlendSet weights = ulr::ulrWeights(nearest);
    for (ulr::Blended& blended : weights) blended.index = candidateAt(blended.index).number;
    return weights;
  }
  const auto sorted = nearest.sorted();
  const size_t count = std::min(count_, sorted.size());
  const float threshold =
      sorted.size() > count ? sorted[count].penalty : std::numeric_limits<float>::infinity();
  std::array<ulr::KrigingSample, ulr::kMaxBlended> samples;
  for (size_t i = 0; i < count; ++i) {
    const Candidate candidate = candidateAt(sorted[i].index);
    samples[i] = {candidate.number, candidate.place,
                  candidate.nugget +
                      ulr::nuggetOf(threshold > 0 ? sorted[i].penalty / threshold : 0, candidate.confidence)};
  }
  return ulr::krigingWeights(
      {samples.data(), count},
      ulr::pairPlace(asked.towards, batch_.towardsView[query_], asked.reached.value_or(1), scales));
}

void PairWeights::leaveOutMissing(const NearPairs& pairs, float* penalties) const {
  for (size_t viewer = 0; viewer < pairs.viewers.size; ++viewer)
    for (size_t light = 0; light < pairs.lights.size; ++light)
      if (numberOf(pairs, viewer, light) == kMissing)
        penalties[kPairLanes * viewer + light] = std::numeric_limits<float>::infinity();
}

float PairWeights::shareOfAllPairs() const {
  float best = 0, photographed = 0;
  for (size_t viewer = 0; viewer < near_.viewers.size; ++viewer)
    for (size_t light = 0; light < near_.lights.size; ++light) {
      const float confidence = near_.confidence(kPairLanes * viewer + light);
      best = std::max(best, confidence);
      if (numberOf(near_, viewer, light) != kMissing) photographed = std::max(photographed, confidence);
    }
  return best > 0 ? std::max(0.f, 1 - 2 * photographed / best) : 0;
}

// Pairs of the nearest views and lights.
ulr::BlendSet PairWeights::nearBlend(const LightQuery& asked) const {
  const ulr::KrigingScales scales = scalesFor(asked);
  const RequestedPair requested = requestedPair(asked, scales);
  std::array<float, 2 * kNearPairs> penalties; // of near pairs, then of exchanged ones
  const size_t nearPairs = kPairLanes * near_.viewers.size, exchanged = kPairLanes * exchanged_.viewers.size;
  writePairPenalties(near_.viewers, near_.lights, requested, penalties.data());
  writePairPenalties(exchanged_.viewers, exchanged_.lights, requested, penalties.data() + nearPairs);
  if (!field_.isFullProduct) {
    leaveOutMissing(near_, penalties.data());
    leaveOutMissing(exchanged_, penalties.data() + nearPairs);
  }
  std::array<uint32_t, ulr::kMaxBlended + 1> places;
  std::array<float, ulr::kMaxBlended + 1> least;
  const size_t found =
      findLeast(penalties.data(), nearPairs + exchanged, count_ + 1, places.data(), least.data());
  ulr::NearestCandidates nearest(count_);
  for (size_t i = 0; i < found; ++i) nearest.offer({places[i], least[i]});
  return weightsOf(nearest, asked, scales, [&](uint32_t place) -> Candidate {
    const bool isExchanged = place >= nearPairs;
    const NearPairs& pairs = isExchanged ? exchanged_ : near_;
    const size_t pair = isExchanged ? place - nearPairs : place;
    return {numberOf(pairs, pair / kPairLanes, pair % kPairLanes), pairs.place(pair, scales),
            pairs.confidence(pair), isExchanged ? kReciprocalNugget : 0};
  });
}

// All pairs that were photographed, with `share` of their confidence where they are not near.
ulr::BlendSet PairWeights::allBlend(const LightQuery& asked, float share) const {
  const ulr::KrigingScales scales = scalesFor(asked);
  const auto count = static_cast<uint32_t>(pairs_.size());
  const auto candidateAt = [&](uint32_t index) -> Candidate {
    const auto& [view, column, light] = pairs_[index % count];
    const auto towards = lights_.towards(light);
    if (index < count)
      return {index,
              ulr::pairPlace(towards, towardsViews_[view], asked.reached ? reachedBy(light) : 1, scales),
              std::max(nearOfAll_.viewers[view] * nearOfAll_.lights[light], share * confidences_[view]), 0};
    const float seen = ulr::VisibilityWeights::decode(field_.visibility.of(surfel_)[view]);
    const float confidence =
        seen * exchangedConfidence(ulr::foreshortenedCosine(normal_, towards),
                                   asked.reached ? *asked.reached * reachedBy(light) : 1);
    return {index % count, ulr::pairPlace(towardsViews_[view], towards, 1, scales),
            std::max(exchangedOfAll_.viewers[light] * exchangedOfAll_.lights[view], share * confidence),
            kReciprocalNugget};
  };
  const ulr::PairPlace requested =
      ulr::pairPlace(asked.towards, batch_.towardsView[query_], asked.reached.value_or(1), scales);
  const bool isExchanged = reciprocal_ && asked.reached.value_or(1) > 0;
  ulr::NearestCandidates nearest(count_);
  for (uint32_t index = 0; index < (isExchanged ? 2 : 1) * count; ++index) {
    const Candidate candidate = candidateAt(index);
    const float apart = std::abs(candidate.place.back() - requested.back()),
                squared = ulr::squaredDistance(candidate.place, requested) - apart * apart;
    nearest.offer({index, penaltyOf(std::max(0.f, squared), apart) / candidate.confidence});
  }
  return weightsOf(nearest, asked, scales, candidateAt);
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

// Adds what all blends have in common to weights by pair.
PairWeights::Blend PairWeights::blendOf(ulr::BlendSet weights, const LightQuery& asked,
                                        const ulr::NearestCandidates& nearestLights,
                                        bool isForeshortened) const {
  Blend blend{std::move(weights)};
  ulr::truncate(blend.weights, weightError_);
  std::ranges::sort(blend.weights, {}, &ulr::Blended::index);
  if (asked.extrapolation == ulr::LightExtrapolation::fade && !nearest_)
    blend.scale = coverage_.at(nearestLights.sorted()[0].penalty);
  if (isForeshortened) blend.scale *= foreshorteningOf(blend.weights, asked);
  if (asked.reached && !blend.weights.empty())
    blend.lacksState = shareOfState(blend.weights, *asked.reached) < 0.5f;
  return blend;
}

// Share of the weights that photographs of the requested shadow state have.
float PairWeights::shareOfState(const ulr::BlendSet& weights, float reached) const {
  float share = 0;
  for (const auto& [number, weight] : weights)
    if (std::abs(reachedBy(pairs_[number].light) - reached) <= 0.5f) share += weight;
  return share;
}

PairWeights::ConfidenceOfAll PairWeights::confidenceOfAll(const NearPairs& pairs, size_t viewers,
                                                          size_t lights) {
  ConfidenceOfAll all{std::vector<float>(viewers), std::vector<float>(lights)};
  for (size_t i = 0; i < pairs.viewers.size; ++i)
    all.viewers[pairs.viewers.index[i]] = pairs.viewers.confidence[i];
  for (size_t i = 0; i < pairs.lights.size; ++i)
    all.lights[pairs.lights.index[i]] = pairs.lights.confidence[i];
  return all;
}

PairWeights::Blend PairWeights::blend(size_t l) {
  const size_t entry = query_ * batch_.lights + l;
  const LightQuery asked{batch_.towardsLight[entry], batch_.extrapolationOf(l),
                         batch_.reached.empty() ? std::nullopt : std::optional(batch_.reached[entry])};
  if (!weighsPairs_) return blendTowards(asked.towards, asked.extrapolation);
  const bool isPrecise = !isSparse_ && nearestOfLight_[l].isPrecise(lane_);
  const ulr::NearestCandidates lights =
      isPrecise ? nearestOfLight_[l].candidates(lane_) : nearestLights(asked.towards);
  if (lights.sorted().empty()) return {};
  if (isSparse_) return blendOf(allBlend(asked, 1), asked, lights, foreshortened_);
  setNearLights(lights, asked.reached.has_value());
  exchanged_.viewers.clear();
  exchanged_.lights.clear();
  if (reciprocal_ && asked.reached.value_or(1) > 0)
    setExchanged(l, asked.reached); // exchanged pairs show a lit surfel
  if (const float share = field_.isFullProduct ? 0 : shareOfAllPairs(); share > 0) {
    setAllViews(views_.computePenalties(query_));
    nearOfAll_ = confidenceOfAll(near_, field_.rig.views.size(), lights_.size());
    exchangedOfAll_ = confidenceOfAll(exchanged_, lights_.size(), field_.rig.views.size());
    return blendOf(allBlend(asked, share), asked, lights, foreshortened_);
  }
  return blendOf(nearBlend(asked), asked, lights, foreshortened_);
}

PairWeights::Blend PairWeights::blendTowards(const Direction3<AcquisitionSpace>& towards,
                                             ulr::LightExtrapolation extrapolation) {
  const ulr::NearestCandidates lights = nearestLights(towards);
  if (lights.sorted().empty()) return {};
  return blendOf(separateBlend(), {towards, extrapolation, {}}, lights, false);
}

} // namespace surflect::shading
