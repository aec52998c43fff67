#include "srf/weights/pair_weights.h"

#include <algorithm>
#include <cmath>

namespace surflect::weights {

PairWeights::PairWeights(const ReflectanceField& field, const LightExtrapolationFade& coverage,
                         const QueryBatch& batch, const ShadeOptions& options)
    : field_(field), coverage_(coverage), batch_(batch), nearest_(options.nearest),
      foreshortened_(lightBlend(field, options).foreshortened),
      count_(options.nearest ? 1 : pairCount(field, options)), weightError_(options.weightError),
      pairs_(field), rig_(field), views_(field, batch, options), lightPenalties_(field.rig.lights.size()) {
  if (usesKriging(field, options)) kriging_.emplace(field, batch, options, pairs_, rig_);
}

void PairWeights::prepare(size_t begin, size_t count) {
  begin_ = begin;
  if (kriging_) kriging_->prepare(begin, count);
}

BestView PairWeights::select(size_t lane) {
  query_ = begin_ + lane;
  rig_.moveTo(batch_.surfels[query_]);
  if (!kriging_) return views_.computePenalties(query_);
  if (!field_.isFullProduct && !batch_.environments.empty()) views_.computePenalties(query_);
  return kriging_->select(lane);
}

PairWeights::Blend PairWeights::blend(size_t l) {
  const size_t entry = query_ * batch_.lights + l;
  if (!kriging_) return blendTowards(batch_.towardsLight[entry], batch_.extrapolationOf(l));
  RequestedLight asked{batch_.towardsLight[entry], {}};
  if (!batch_.reached.empty()) asked.reached = batch_.reached[entry];
  const auto [weights, lightPenalty] = kriging_->blend(l, asked);
  Blend blend = finished(weights, lightPenalty, batch_.extrapolationOf(l));
  if (foreshortened_) blend.scale *= foreshorteningOf(blend.weights, asked);
  if (asked.reached && !blend.weights.empty())
    blend.lacksState = shareOfState(blend.weights, *asked.reached) < 0.5f;
  return blend;
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
  if (extrapolation == LightExtrapolation::fade && !nearest_) blend.scale = coverage_.at(lightPenalty);
  return blend;
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

// Share of the weights that photographs of the requested shadow state have.
float PairWeights::shareOfState(const BlendSet& weights, float reached) const {
  float share = 0;
  for (const auto& [number, weight] : weights)
    if (std::abs(rig_.reachedBy(pairs_[number].light) - reached) <= 0.5f) share += weight;
  return share;
}

} // namespace surflect::weights
