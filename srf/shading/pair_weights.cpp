#include "srf/shading/pair_weights.h"

#include "srf/ulr/weight_truncation.h"

#include <algorithm>
#include <limits>

namespace surflect::shading {

PairWeights::PairWeights(const ReflectanceField& field, const ulr::LightExtrapolationFade& coverage,
                         const QueryBatch& batch, const ShadeOptions& options)
    : field_(field), coverage_(coverage), batch_(batch), nearest_(options.nearest),
      count_(options.nearest ? 1 : options.pairs), weightError_(options.weightError),
      views_(field, batch, options), lights_(field.rig.lights), lightPenalty_(field.rig.lights.size()) {
  for (const auto& lights : field.columns) {
    firstPair_.push_back(pairs_);
    pairs_ += lights.size();
  }
}

BestView PairWeights::prepare(size_t query) {
  lights_.moveTo(field_.cloud.p0[batch_.surfels[query]].cast<double>());
  lights_.evaluateAll();
  return views_.computePenalties(query);
}

PairWeights::Blend PairWeights::blend(const Direction3<AcquisitionSpace>& towardsLight,
                                      ulr::LightExtrapolation extrapolation) {
  float least = std::numeric_limits<float>::infinity();
  for (size_t light = 0; light < lights_.size(); ++light) {
    lightPenalty_[light] = ulr::anglePenalty(lights_.towards(light), towardsLight);
    least = std::min(least, lightPenalty_[light]);
  }
  ulr::NearestCandidates nearest(count_);
  for (size_t view = 0; view < field_.columns.size(); ++view) {
    const auto& lights = field_.columns[view];
    for (size_t column = 0; column < lights.size(); ++column)
      nearest.offer({static_cast<uint32_t>(firstPair_[view] + column),
                     views_.penalty(view, lightPenalty_[lights[column]])});
  }
  ulr::BlendSet weights = ulr::ulrWeights(nearest);
  ulr::truncate(weights, weightError_);
  return {weights, extrapolation == ulr::LightExtrapolation::fade && !nearest_ ? coverage_.at(least) : 1.f};
}

PairWeights::Pair PairWeights::pair(uint32_t number) const {
  const auto next = std::ranges::upper_bound(firstPair_, size_t{number});
  const auto view = static_cast<uint32_t>(next - firstPair_.begin() - 1);
  const auto column = static_cast<uint32_t>(number - firstPair_[view]);
  return {view, column, field_.columns[view][column]};
}

} // namespace surflect::shading
