#include "srf/weights/pair_weights.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace surflect::weights {

namespace {

ShadeOptions withNearViews(ShadeOptions options) {
  options.cameras = kNearSources;
  options.weightError = 0;
  return options;
}

} // namespace

KrigingWeights::KrigingWeights(const ReflectanceField& field, const QueryBatch& batch,
                               const ShadeOptions& options, const CapturedPairs& pairs,
                               const RigAtSurfel& rig)
    : field_(field), batch_(batch), pairs_(pairs), rig_(rig), isSparse_(!field.hasNearPairs),
      reciprocal_(isReciprocal(field, options)), litScales_(scalesFor(field.interpolation.halfScale, 1)),
      shadowScales_(scalesFor(field.interpolation.halfScale, 0)), count_(pairCount(field, options)),
      views_(field, batch, withNearViews(options)), nearestLights_(sourcesOf(viewpointsOf(field.rig.lights))),
      nearestOfLight_(batch.lights), nearConfidences_(2 * pairs.size()) {
  if (reciprocal_ && !isSparse_) exchange_.emplace(field, batch);
}

void KrigingWeights::prepare(size_t begin, size_t count) {
  begin_ = begin;
  if (isSparse_) return;
  views_.prepare(begin, count);
  const auto places = batch_.placesAt(field_.cloud, begin, count);
  nearestLights_.setPlaces({places.data(), count});
  for (size_t l = 0; l < batch_.lights; ++l)
    nearestLights_.blend({batch_.towardsLightAt(l, begin, count).data(), count}, kNearSources,
                         nearestOfLight_[l]);
  if (exchange_) exchange_->prepare(begin, count, nearestLights_);
}

BestView KrigingWeights::select(size_t lane) {
  lane_ = lane;
  query_ = begin_ + lane;
  if (isSparse_) {
    const BestView best = views_.computePenalties(query_);
    setAllViews(best);
    return best;
  }
  const auto [views, best] = views_.nearest(lane);
  near_.viewers.clear();
  forEachNear(views, [&, &best = best](uint32_t view, float penalty, float nearness) {
    const auto towards = rig_.towardsView(view);
    near_.viewers.add(view, towards, confidenceIn(view, towards, penalty, best) * nearness);
  });
  return best;
}

float KrigingWeights::confidenceIn(uint32_t view, const Direction3<AcquisitionSpace>& towards, float penalty,
                                   const BestView& best) const {
  const float seen = rig_.seenBy(view);
  if (best.penalty <= kFallbackFrom) return seen;
  const float angle = anglePenalty(towards, batch_.towardsView[query_]);
  const float begun = std::min(1.f, best.penalty - kFallbackFrom); // fallbacks fade in
  return std::max(seen, begun * fallbackConfidence(angle, penalty));
}

void KrigingWeights::setAllViews(const BestView& best) {
  towardsViews_.clear();
  confidences_.clear();
  for (uint32_t view = 0; view < field_.rig.views.size(); ++view) {
    towardsViews_.push_back(rig_.towardsView(view));
    confidences_.push_back(confidenceIn(view, towardsViews_[view], views_.penalty(view, 0), best));
  }
}

void KrigingWeights::setExchangedConfidences() {
  exchangedConfidences_.clear();
  if (!reciprocal_ || asked_.state() <= 0) return;
  for (uint32_t light = 0; light < field_.rig.lights.size(); ++light)
    exchangedConfidences_.push_back(exchangedConfidence(rig_, light, asked_.reached));
}

KrigingScales KrigingWeights::scalesOf(const RequestedLight& asked) const {
  if (asked.state() <= 0) return shadowScales_;
  return asked.state() >= 1 ? litScales_ : scalesFor(field_.interpolation.halfScale, asked.state());
}

NearestCandidates KrigingWeights::nearestLights(const Direction3<AcquisitionSpace>& towards) const {
  NearestCandidates nearest(kNearSources);
  for (uint32_t light = 0; light < rig_.lights().size(); ++light)
    nearest.offer({light, anglePenalty(rig_.lights().towards(light), towards)});
  return nearest;
}

// A pair leaves the blend as its distance grows, or as the confidence in its view or light falls.
template <class CandidateAt, class Use>
void KrigingWeights::forEachSample(const NearestCandidates& nearest, const CandidateAt& candidateAt,
                                   const Use& use) const {
  const auto sorted = nearest.sorted();
  const size_t count = std::min(count_, sorted.size());
  const float threshold = sorted.size() > count ? sorted[count].penalty : kInfinity;
  for (const auto& [index, penalty] : sorted.first(count)) {
    const Candidate candidate = candidateAt(index);
    use(KrigingSample{candidate.number, candidate.place,
                      candidate.nugget +
                          nuggetOf(threshold > 0 ? penalty / threshold : 0, candidate.confidence)});
  }
}

void KrigingWeights::leaveOutMissing(const NearPairs& pairs, float* penalties) const {
  pairs.forEach([&](size_t pair) {
    if (pairs.numberIn(pairs_, pair) == CapturedPairs::kMissing) penalties[pair] = kInfinity;
  });
}

float KrigingWeights::shareOfAllPairs() const {
  float best = 0, photographed = 0;
  near_.forEach([&](size_t pair) {
    best = std::max(best, near_.confidence(pair));
    if (near_.numberIn(pairs_, pair) != CapturedPairs::kMissing)
      photographed = std::max(photographed, near_.confidence(pair));
  });
  return best > 0 ? std::max(0.f, 1 - 2 * photographed / best) : 0;
}

void KrigingWeights::noteNearConfidences(const NearPairs& pairs) {
  pairs.forEach([&](size_t pair) {
    if (const uint32_t number = pairs.numberIn(pairs_, pair); number != CapturedPairs::kMissing)
      nearConfidences_[number + (pairs.isExchanged ? pairs_.size() : 0)] = pairs.confidence(pair);
  });
}

NearestCandidates KrigingWeights::nearestPairs(const NearPairs& near, const NearPairs& exchanged,
                                               const RequestedPair& requested) const {
  std::array<float, 2 * kNearPairs> penalties; // of near pairs, then of exchanged ones
  writePairPenalties(near, requested, penalties.data());
  writePairPenalties(exchanged, requested, penalties.data() + near.size());
  if (!field_.isFullProduct) {
    leaveOutMissing(near, penalties.data());
    leaveOutMissing(exchanged, penalties.data() + near.size());
  }
  std::array<uint32_t, kMaxBlended + 1> places;
  std::array<float, kMaxBlended + 1> least;
  const size_t found =
      findLeast(penalties.data(), near.size() + exchanged.size(), count_ + 1, places.data(), least.data());
  NearestCandidates nearest(count_);
  for (size_t i = 0; i < found; ++i) nearest.offer({places[i], least[i]});
  return nearest;
}

// Pairs of the nearest views and lights.
size_t KrigingWeights::askNearPairs(KrigingBatch& batch) const {
  const KrigingScales scales = scalesOf(asked_);
  const auto& towardsView = batch_.towardsView[query_];
  const NearestCandidates nearest =
      nearestPairs(near_, exchanged_, requestedPair(asked_.towards, towardsView, asked_.state(), scales));
  const size_t request = batch.ask(pairPlace(asked_.towards, towardsView, asked_.state(), scales));
  const auto candidateAt = [&](uint32_t place) -> Candidate {
    const bool isExchanged = place >= near_.size();
    const NearPairs& pairs = isExchanged ? exchanged_ : near_;
    const size_t pair = isExchanged ? place - near_.size() : place;
    return {pairs.numberIn(pairs_, pair), pairs.place(pair, scales), pairs.confidence(pair),
            isExchanged ? kReciprocalNugget : 0};
  };
  forEachSample(nearest, candidateAt, [&](const KrigingSample& sample) { batch.add(sample); });
  return request;
}

std::span<const LitPhotograph> KrigingWeights::litPhotographs() {
  const RequestedLight& asked = asked_;
  const auto& towardsView = batch_.towardsView[query_];
  size_t count = 0;
  const auto keep = [&](const KrigingSample& sample) {
    const auto& [view, column, light] = pairs_[sample.index];
    litPhotographs_[count++] = {sample, rig_.towardsView(view), rig_.lights().towards(light)};
  };
  if (shareOfAll_ > 0) {
    const auto candidateAt = [&](uint32_t number) -> Candidate {
      const auto& [view, column, light] = pairs_[number];
      const float confidence =
          std::max(isSparse_ ? 0 : nearConfidences_[number], shareOfAll_ * confidences_[view]);
      return {number, pairPlace(rig_.lights().towards(light), towardsViews_[view], 1, kResidualScales),
              confidence * litConfidence(light), 0};
    };
    const PairPlace requested = pairPlace(asked.towards, towardsView, 1, kResidualScales);
    NearestCandidates nearest(count_);
    for (uint32_t number = 0; number < pairs_.size(); ++number) {
      const Candidate candidate = candidateAt(number);
      nearest.offer({number, krigingPenalty(candidate.place, requested) / candidate.confidence});
    }
    forEachSample(nearest, candidateAt, keep);
  } else {
    NearPairs lit = near_;
    for (size_t light = 0; light < lit.lights.size; ++light) {
      lit.lights.confidence[light] *= litConfidence(lit.lights.index[light]);
      lit.lights.reached[light] = 1;
    }
    const NearestCandidates nearest =
        nearestPairs(lit, {}, requestedPair(asked.towards, towardsView, 1, kResidualScales));
    const auto candidateAt = [&](uint32_t pair) -> Candidate {
      return {lit.numberIn(pairs_, pair), lit.place(pair, kResidualScales), lit.confidence(pair), 0};
    };
    forEachSample(nearest, candidateAt, keep);
  }
  return {litPhotographs_.data(), count};
}

// All photographed pairs, with `share` of their confidence where they are not near.
size_t KrigingWeights::askAllPairs(KrigingBatch& batch) const {
  const RequestedLight& asked = asked_;
  const float share = shareOfAll_;
  const KrigingScales scales = scalesOf(asked);
  const auto count = static_cast<uint32_t>(pairs_.size());
  // Exchanged pairs have indices from `count` on.
  const auto confidenceIn = [&](uint32_t index, const CapturedPairs::Pair& pair) {
    const float confidence =
        index < count ? confidences_[pair.view] : rig_.seenBy(pair.view) * exchangedConfidences_[pair.light];
    return std::max(nearConfidences_[index], share * confidence);
  };
  const auto placeOf = [&](uint32_t index, const CapturedPairs::Pair& pair) {
    const auto &towardsLight = rig_.lights().towards(pair.light), &towardsView = towardsViews_[pair.view];
    return index < count
               ? pairPlace(towardsLight, towardsView, asked.reached ? rig_.reachedBy(pair.light) : 1, scales)
               : pairPlace(towardsView, towardsLight, 1, scales);
  };
  const PairPlace requested = pairPlace(asked.towards, batch_.towardsView[query_], asked.state(), scales);
  NearestCandidates nearest(count_);
  const auto offerFrom = [&](uint32_t begin) {
    for (uint32_t number = 0; number < count; ++number) {
      const CapturedPairs::Pair& pair = pairs_[number];
      const uint32_t index = begin + number;
      const float confidence = confidenceIn(index, pair);
      if (confidence > 0)
        nearest.offer({index, krigingPenalty(placeOf(index, pair), requested) / confidence});
    }
  };
  offerFrom(0);
  if (reciprocal_ && asked.state() > 0) offerFrom(count);
  const auto candidateAt = [&](uint32_t index) -> Candidate {
    const uint32_t number = index % count;
    const CapturedPairs::Pair& pair = pairs_[number];
    return {number, placeOf(index, pair), confidenceIn(index, pair), index < count ? 0 : kReciprocalNugget};
  };
  const size_t request = batch.ask(requested);
  forEachSample(nearest, candidateAt, [&](const KrigingSample& sample) { batch.add(sample); });
  return request;
}

float KrigingWeights::setLight(size_t l, const RequestedLight& asked) {
  asked_ = asked;
  const bool isPrecise = !isSparse_ && nearestOfLight_[l].isPrecise(lane_);
  const NearestCandidates lights =
      isPrecise ? nearestOfLight_[l].candidates(lane_) : nearestLights(asked.towards);
  near_.lights.clear();
  exchanged_ = {};
  shareOfAll_ = isSparse_ ? 1 : 0;
  if (lights.sorted().empty()) return kInfinity;
  const float lightPenalty = lights.sorted()[0].penalty;
  if (isSparse_) {
    setExchangedConfidences();
    return lightPenalty;
  }
  forEachNear(lights, [&](uint32_t light, float, float nearness) {
    near_.lights.add(light, rig_.lights().towards(light), nearness,
                     asked.reached ? rig_.reachedBy(light) : 1);
  });
  if (exchange_ && asked.state() > 0) exchanged_ = exchange_->near(lane_, l, asked.reached, rig_);
  if (field_.isFullProduct) return lightPenalty;
  shareOfAll_ = shareOfAllPairs();
  if (shareOfAll_ <= 0) return lightPenalty;
  setAllViews(views_.computePenalties(query_));
  setExchangedConfidences();
  std::ranges::fill(nearConfidences_, 0.f);
  noteNearConfidences(near_);
  noteNearConfidences(exchanged_);
  return lightPenalty;
}

size_t KrigingWeights::ask(KrigingBatch& batch) const {
  return shareOfAll_ > 0 ? askAllPairs(batch) : askNearPairs(batch);
}

PairWeights::PairWeights(const ReflectanceField& field, const LightExtrapolationFade& coverage,
                         const QueryBatch& batch, const ShadeOptions& options)
    : field_(field), coverage_(coverage), batch_(batch), nearest_(options.nearest),
      foreshortened_(lightBlend(field, options).foreshortened),
      isKriged_(usesKriging(field, options) && !isSeparateBesideTables(field, options)),
      count_(options.nearest ? 1 : ulrPairCount(field, options)), weightError_(options.weightError),
      pairs_(field), rig_(field), views_(field, batch, options), lightPenalties_(field.rig.lights.size()) {
  if (usesKriging(field, options)) kriging_.emplace(field, batch, options, pairs_, rig_);
  if (usesTables(field, options)) shared_.emplace(field);
}

void PairWeights::moveTo(size_t query) {
  query_ = query;
  rig_.moveTo(batch_.surfels[query]);
}

void PairWeights::prepare(size_t begin, size_t count) {
  begin_ = begin;
  if (!kriging_) return;
  kriging_->prepare(begin, count);
  prepared_.assign(count * batch_.lights, {});
  pairBatch_.clear();
  residuals_.clear();
  for (size_t lane = 0; lane < count; ++lane) prepareLights(lane);
  pairBatch_.solve();
  residuals_.solveSimple();
}

// Asks for the weights of all lights of a query.
void PairWeights::prepareLights(size_t lane) {
  moveTo(begin_ + lane);
  if (shared_) shared_->moveTo(batch_.surfels[query_]);
  const auto& towardsView = batch_.towardsView[query_];
  bestViews_[lane] = kriging_->select(lane);
  for (size_t l = 0; l < batch_.lights; ++l) {
    Prepared& light = prepared_[lane * batch_.lights + l];
    const RequestedLight asked = requestedLight(l);
    light.lightPenalty = kriging_->setLight(l, asked);
    if (shared_) light.share = shared_->shareOf(towardsView, asked);
    if (light.share > 0)
      light.predicted = shared_->ask(towardsView, asked.towards, kriging_->litPhotographs(), residuals_);
    if (isKriged_ && light.share < 1) light.request = kriging_->ask(pairBatch_);
  }
}

BestView PairWeights::select(size_t lane) {
  moveTo(begin_ + lane);
  if (!kriging_) return views_.computePenalties(query_);
  if (!field_.isFullProduct && (!isKriged_ || !batch_.environments.empty())) views_.computePenalties(query_);
  return bestViews_[lane];
}

RequestedLight PairWeights::requestedLight(size_t l) const {
  const size_t entry = query_ * batch_.lights + l;
  return {batch_.towardsLight[entry],
          batch_.reached.empty() ? std::nullopt : std::optional(batch_.reached[entry])};
}

void PairWeights::setLight(size_t l) {
  light_ = l;
  asked_ = requestedLight(l);
}

PairWeights::Blend PairWeights::blend() {
  const LightExtrapolation extrapolation = batch_.extrapolationOf(light_);
  if (!isKriged_) return blendTowards(asked_.towards, extrapolation);
  Blend blend = finished(pairBatch_.positiveWeights(prepared().request.value()), prepared().lightPenalty,
                         extrapolation);
  if (foreshortened_) blend.scale *= foreshorteningOf(blend.weights, asked_);
  if (asked_.reached && !blend.weights.empty())
    blend.lacksState = shareOfState(blend.weights, *asked_.reached) < 0.5f;
  return blend;
}

std::optional<PairWeights::Shared> PairWeights::shared() const {
  if (!shared_ || prepared().share <= 0) return std::nullopt;
  const Prepared& light = prepared();
  return Shared{shared_->blendOf(light.predicted, residuals_), light.share,
                fadeOf(light.lightPenalty, batch_.extrapolationOf(light_))};
}

PairWeights::Blend PairWeights::blendTowards(const Direction3<AcquisitionSpace>& towards,
                                             LightExtrapolation extrapolation) {
  float least = kInfinity;
  for (uint32_t light = 0; light < lightPenalties_.size(); ++light) {
    lightPenalties_[light] = anglePenalty(rig_.lights().towards(light), towards);
    least = std::min(least, lightPenalties_[light]);
  }
  NearestCandidates nearest(count_);
  for (uint32_t view = 0; view < field_.columns.size(); ++view) {
    if (!(views_.penalty(view, 0) < nearest.worst())) continue; // no light makes its penalty less
    for (size_t column = 0; column < field_.columns[view].size(); ++column)
      nearest.offer({static_cast<uint32_t>(pairs_.firstOf(view) + column),
                     views_.penalty(view, lightPenalties_[field_.columns[view][column]])});
  }
  return finished(ulrWeights(nearest), least, extrapolation);
}

// Truncates the weights and fades them by the penalty of the nearest light.
PairWeights::Blend PairWeights::finished(const BlendSet& weights, float lightPenalty,
                                         LightExtrapolation extrapolation) const {
  Blend blend{truncated(weights, weightError_)};
  std::ranges::sort(blend.weights, {}, &Blended::index);
  blend.scale = fadeOf(lightPenalty, extrapolation);
  return blend;
}

float PairWeights::fadeOf(float lightPenalty, LightExtrapolation extrapolation) const {
  return extrapolation == LightExtrapolation::fade && !nearest_ ? coverage_.at(lightPenalty) : 1;
}

// Foreshortening f of a blend. A light that does not reach the surfel has no cosine, so that photographs in
// which the surfel is lit also answer for shadow where there are no others.
float PairWeights::foreshorteningOf(const BlendSet& blend, const RequestedLight& asked) const {
  float blended = 0;
  for (const auto& [number, weight] : blend) {
    const uint32_t light = pairs_[number].light;
    blended +=
        weight * rig_.cosine(rig_.lights().towards(light)) * (asked.reached ? rig_.reachedBy(light) : 1);
  }
  return foreshortening(asked.state() * rig_.cosine(asked.towards), blended);
}

float PairWeights::reachedPart(const BlendSet& weights, float scale) const {
  ReachedPart part;
  for (const auto& [number, weight] : weights) {
    const uint32_t light = pairs_[number].light;
    part.add(scale * weight, rig_.cosine(rig_.lights().towards(light)),
             field_.lightVisibility ? rig_.reachedBy(light) : 1);
  }
  return part.value();
}

// Share of the weights that photographs of the requested shadow state have.
float PairWeights::shareOfState(const BlendSet& weights, float reached) const {
  float share = 0;
  for (const auto& [number, weight] : weights)
    if (std::abs(rig_.reachedBy(pairs_[number].light) - reached) <= 0.5f) share += weight;
  return share;
}

} // namespace surflect::weights
