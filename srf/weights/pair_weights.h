// Weights of (camera, light) pairs for the lights of a query, where cameras and lights are not weighted
// apart. Decides which of two ways answers each light (the table in interpolation.h), and adds what both
// share.
//
//   kriging:      by kriging_weights.h
//   otherwise:    by ULR over all photographed pairs,  p_ij = p_i + p_j
//
// Symbols: p_i penalty of view i (camera_weights.h), p_j = 1 - cos of the angle at the surfel between
// captured light j and the light of the query  [Weyrich 2005, §5.2].
#pragma once

#include "srf/weights/kriging_weights.h"

#include <optional>
#include <vector>

namespace surflect::weights {

// Computes the pair weights of one query after another. Has working memory of its own: use one object per
// thread.
class PairWeights {
public:
  // The arguments must outlive the weights.
  PairWeights(const ReflectanceField& field, const LightExtrapolationFade& coverage, const QueryBatch& batch,
              const ShadeOptions& options);
  PairWeights(const PairWeights&) = delete; // kriging refers to the members
  PairWeights& operator=(const PairWeights&) = delete;

  // Prepares the queries from `begin` on (1..kQueryLanes), in vector lanes.
  void prepare(size_t begin, size_t count);
  // Selects the lane-th prepared query for the methods below.
  BestView select(size_t lane);

  struct Blend {
    BlendSet weights; // index is the number of a pair, ascending
    float scale = 1;  // fade where no light was captured (fades.h), times foreshortening
    // True if photographs of the requested shadow state have less than half of the weights.
    bool lacksState = false;
  };
  // The pairs for the l-th light of the query.
  Blend blend(size_t l);
  // The pairs for a light of an environment, by ULR over all photographed pairs.
  Blend blendTowards(const Direction3<AcquisitionSpace>& towards, LightExtrapolation extrapolation);

  const CapturedPairs& pairs() const { return pairs_; }
  // Irradiance of a captured light at the query's surfel.
  Rgb irradiance(size_t light) const { return rig_.lights().irradiance(light); }
  // irradianceRatio of `now` to the captured light.
  Rgb ratio(const Rgb& now, size_t light) const {
    const Eigen::Array4f ratio = rig_.lights().ratio({0, now.r, now.g, now.b}, light);
    return {ratio[1], ratio[2], ratio[3]};
  }

private:
  Blend finished(const BlendSet& weights, float lightPenalty, LightExtrapolation extrapolation) const;
  float foreshorteningOf(const BlendSet& blend, const RequestedLight& asked) const;
  float shareOfState(const BlendSet& weights, float reached) const;

  const ReflectanceField& field_;
  const LightExtrapolationFade& coverage_;
  const QueryBatch& batch_;
  const bool nearest_, foreshortened_;
  const size_t count_; // number of pairs blended
  const float weightError_;
  const CapturedPairs pairs_;
  RigAtSurfel rig_;
  CameraWeights views_;
  std::optional<KrigingWeights> kriging_; // if it answers directional and point lights
  std::vector<float> lightPenalties_;     // p_j of all captured lights
  size_t begin_ = 0, query_ = 0;          // first prepared query; selected query
};

} // namespace surflect::weights
