#include "srf/weights/kriging_weights.h"

#include <algorithm>
#include <array>

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
template <class CandidateAt>
BlendSet KrigingWeights::weightsOf(const NearestCandidates& nearest, const PairPlace& requested,
                                   const CandidateAt& candidateAt) const {
  const auto sorted = nearest.sorted();
  const size_t count = std::min(count_, sorted.size());
  const float threshold = sorted.size() > count ? sorted[count].penalty : kInfinity;
  std::array<KrigingSample, kMaxBlended> samples;
  for (size_t i = 0; i < count; ++i) {
    const Candidate candidate = candidateAt(sorted[i].index);
    samples[i] = {candidate.number, candidate.place,
                  candidate.nugget +
                      nuggetOf(threshold > 0 ? sorted[i].penalty / threshold : 0, candidate.confidence)};
  }
  return krigingWeights({samples.data(), count}, requested);
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

// Pairs of the nearest views and lights.
BlendSet KrigingWeights::nearBlend(const RequestedLight& asked) const {
  const KrigingScales scales = scalesOf(asked);
  const auto& towardsView = batch_.towardsView[query_];
  const RequestedPair requested = requestedPair(asked.towards, towardsView, asked.state(), scales);
  std::array<float, 2 * kNearPairs> penalties; // of near pairs, then of exchanged ones
  writePairPenalties(near_, requested, penalties.data());
  writePairPenalties(exchanged_, requested, penalties.data() + near_.size());
  if (!field_.isFullProduct) {
    leaveOutMissing(near_, penalties.data());
    leaveOutMissing(exchanged_, penalties.data() + near_.size());
  }
  std::array<uint32_t, kMaxBlended + 1> places;
  std::array<float, kMaxBlended + 1> least;
  const size_t found =
      findLeast(penalties.data(), near_.size() + exchanged_.size(), count_ + 1, places.data(), least.data());
  NearestCandidates nearest(count_);
  for (size_t i = 0; i < found; ++i) nearest.offer({places[i], least[i]});
  return weightsOf(nearest, pairPlace(asked.towards, towardsView, asked.state(), scales),
                   [&](uint32_t place) -> Candidate {
                     const bool isExchanged = place >= near_.size();
                     const NearPairs& pairs = isExchanged ? exchanged_ : near_;
                     const size_t pair = isExchanged ? place - near_.size() : place;
                     return {pairs.numberIn(pairs_, pair), pairs.place(pair, scales), pairs.confidence(pair),
                             isExchanged ? kReciprocalNugget : 0};
                   });
}

// All photographed pairs, with `share` of their confidence where they are not near.
BlendSet KrigingWeights::allBlend(const RequestedLight& asked, float share) const {
  const KrigingScales scales = scalesOf(asked);
  const auto count = static_cast<uint32_t>(pairs_.size());
  const auto candidateAt = [&](uint32_t index) -> Candidate { // exchanged from `count` on
    const auto& [view, column, light] = pairs_[index % count];
    const auto towards = rig_.lights().towards(light);
    const bool isExchanged = index >= count;
    const float confidence = isExchanged ? rig_.seenBy(view) * exchangedConfidence(rig_, light, asked.reached)
                                         : confidences_[view];
    return {index % count,
            isExchanged
                ? pairPlace(towardsViews_[view], towards, 1, scales)
                : pairPlace(towards, towardsViews_[view], asked.reached ? rig_.reachedBy(light) : 1, scales),
            std::max(nearConfidences_[index], share * confidence), isExchanged ? kReciprocalNugget : 0};
  };
  const PairPlace requested = pairPlace(asked.towards, batch_.towardsView[query_], asked.state(), scales);
  NearestCandidates nearest(count_);
  for (uint32_t index = 0; index < (reciprocal_ && asked.state() > 0 ? 2 : 1) * count; ++index) {
    const Candidate candidate = candidateAt(index);
    nearest.offer({index, krigingPenalty(candidate.place, requested) / candidate.confidence});
  }
  return weightsOf(nearest, requested, candidateAt);
}

KrigingWeights::Blend KrigingWeights::blend(size_t l, const RequestedLight& asked) {
  const bool isPrecise = !isSparse_ && nearestOfLight_[l].isPrecise(lane_);
  const NearestCandidates lights =
      isPrecise ? nearestOfLight_[l].candidates(lane_) : nearestLights(asked.towards);
  if (lights.sorted().empty()) return {};
  const float lightPenalty = lights.sorted()[0].penalty;
  if (isSparse_) return {allBlend(asked, 1), lightPenalty};
  near_.lights.clear();
  forEachNear(lights, [&](uint32_t light, float, float nearness) {
    near_.lights.add(light, rig_.lights().towards(light), nearness,
                     asked.reached ? rig_.reachedBy(light) : 1);
  });
  exchanged_ = exchange_ && asked.state() > 0 ? exchange_->near(lane_, l, asked.reached, rig_) : NearPairs{};
  const float share = field_.isFullProduct ? 0 : shareOfAllPairs();
  if (share <= 0) return {nearBlend(asked), lightPenalty};
  setAllViews(views_.computePenalties(query_));
  std::ranges::fill(nearConfidences_, 0.f);
  noteNearConfidences(near_);
  noteNearConfidences(exchanged_);
  return {allBlend(asked, share), lightPenalty};
}

} // namespace surflect::weights
