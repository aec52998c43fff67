// Weights of (camera, light) pairs for the lights of a query, where cameras and lights are not weighted
// apart. Decides which of two ways answers each light (the table in interpolation.h), and adds what both
// share.
//
//   kriging:      by KrigingWeights, below
//   otherwise:    by ULR over all photographed pairs,  p_ij = p_i + p_j
//
// Symbols: p_i penalty of view i (camera_weights.h), p_j = 1 - cos of the angle at the surfel between
// captured light j and the light of the query  [Weyrich 2005, §5.2].
#pragma once

#include "srf/weights/camera_weights.h"
#include "srf/weights/nearest_pairs.h"
#include "srf/weights/reciprocity.h"
#include "srf/weights/shared_weights.h"

#include <optional>
#include <vector>

namespace surflect::weights {

// Kriging weights of photographs for a light of a query: the (camera, light) pairs that are kriged
// (kriging.h), and the confidence in each.
//   p_ij = d_ij (1 + t_j) / c_ij,   w_ij by kriging over the pairs of least p_ij
// Symbols: d_ij distance of the pair of view i and light j from the requested pair without shadow states,
// t_j difference of their shadow states in scales; c_ij = s_i n_i n_j confidence in a pair, 0..1: s_i
// visibility weight of view i, or fallbackConfidence (fallback_view.h) where no view sees the surfel well;
// n_i, n_j nearness of view and light to the requested directions.
// Full product: the pairs of the nearest views and lights are considered. Few gaps: all other pairs fade in
// where the best near pairs were not photographed. Let c be the greatest confidence among near pairs that
// were photographed, c' that among all near pairs, and g = max(0, 1 - 2 c / c'). Every photographed pair then
// has a confidence of at least g s_i: g is 0 as long as a near pair with half of c' was photographed, and
// grows to 1 as the photographed near pairs lose their confidence. Wide gaps (hasNearPairs): all photographed
// pairs are considered, with n_i = n_j = 1.
// Pairs with camera and light exchanged are considered, too, if they answer (reciprocity.h).

// Computes the kriging weights of one query after another. Has working memory of its own: use one object per
// thread.
class KrigingWeights {
public:
  // The arguments must outlive the weights.
  KrigingWeights(const ReflectanceField& field, const QueryBatch& batch, const ShadeOptions& options,
                 const CapturedPairs& pairs, const RigAtSurfel& rig);

  // Finds the views and lights nearest to the queries from `begin` on (1..kQueryLanes), in vector lanes.
  void prepare(size_t begin, size_t count);
  // Selects the lane-th prepared query, to whose surfel the rig has moved.
  BestView select(size_t lane);

  // Selects the l-th light of the selected query, for the methods below. Returns the penalty of the captured
  // light nearest to it; infinite if there is none, and nothing to blend.
  float setLight(size_t l, const RequestedLight& asked);
  // Begins a request in a batch, with the pairs for the light as its samples; indices are numbers of pairs.
  // Returns its number.
  size_t ask(KrigingBatch& batch) const;
  // The photographs nearest to the light by kResidualScales, less trusted if less of their light reaches
  // the surfel.
  std::span<const LitPhotograph> litPhotographs();

private:
  // A pair that may be blended.
  struct Candidate {
    uint32_t number;
    PairPlace place;
    float confidence, nugget; // c_ij; nugget in addition to nuggetOf
  };

  KrigingScales scalesOf(const RequestedLight& asked) const;
  NearestCandidates nearestLights(const Direction3<AcquisitionSpace>& towards) const;
  float confidenceIn(uint32_t view, const Direction3<AcquisitionSpace>& towards, float penalty,
                     const BestView& best) const;
  void setAllViews(const BestView& best);
  void setExchangedConfidences();
  float shareOfAllPairs() const; // g
  void noteNearConfidences(const NearPairs& pairs);
  void leaveOutMissing(const NearPairs& pairs, float* penalties) const;
  size_t askNearPairs(KrigingBatch& batch) const;
  size_t askAllPairs(KrigingBatch& batch) const;
  // Calls use(sample) for the nearest of the candidates; indices are numbers of pairs.
  template <class CandidateAt, class Use>
  void forEachSample(const NearestCandidates& nearest, const CandidateAt& candidateAt, const Use& use) const;
  // The count_ + 1 pairs of least penalty among near ones and exchanged ones.
  NearestCandidates nearestPairs(const NearPairs& near, const NearPairs& exchanged,
                                 const RequestedPair& requested) const;
  // Confidence in photographs of a light as those of a lit surfel: 1 unless less of it reaches the surfel
  // than of the requested light.
  float litConfidence(uint32_t light) const {
    return 1 - std::max(0.f, asked_.state() - (field_.lightVisibility ? rig_.reachedBy(light) : 1));
  }

  const ReflectanceField& field_;
  const QueryBatch& batch_;
  const CapturedPairs& pairs_;
  const RigAtSurfel& rig_;
  const bool isSparse_, reciprocal_; // sparse: a capture with wide gaps
  const KrigingScales litScales_, shadowScales_;
  const size_t count_; // number of pairs blended
  CameraWeights views_;
  NearestLights nearestLights_;
  std::vector<QueryBlends> nearestOfLight_; // per light of a query
  std::optional<ExchangedPairs> exchange_;
  size_t begin_ = 0;
  // State of the selected query.
  size_t query_ = 0, lane_ = 0;
  RequestedLight asked_;
  NearPairs near_, exchanged_;
  std::vector<Direction3<AcquisitionSpace>> towardsViews_; // all, where all pairs are considered
  std::vector<float> confidences_;                         // in these views
  std::vector<float> exchangedConfidences_;                // in lights as viewers of exchanged pairs
  std::vector<float> nearConfidences_; // c_ij of photographed near pairs, else 0; by number, then exchanged
  float shareOfAll_ = 0;               // g of the light; 1 in a capture with wide gaps
  std::array<LitPhotograph, kMaxBlended> litPhotographs_;
};

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

  // Selects the l-th light of the query for the next two methods.
  void setLight(size_t l);

  struct Blend {
    BlendSet weights; // index is the number of a pair, ascending
    float scale = 1;  // fade where no light was captured (fades.h), times foreshortening
    // True if photographs of the requested shadow state have less than half of the weights.
    bool lacksState = false;
  };
  // The pairs for the light. Not called where tables answer with a share of 1.
  Blend blend();

  // Answer of the tables for the light; empty without tables, or with a share of 0.
  struct Shared {
    SharedBlend blend;
    float share; // m
    float fade;  // where no light was captured (fades.h)
  };
  std::optional<Shared> shared() const;
  // The pairs for a light of an environment, by ULR over all photographed pairs.
  Blend blendTowards(const Direction3<AcquisitionSpace>& towards, LightExtrapolation extrapolation);
  // V of a light of an environment (irradiance_ratio.h), by the weights and the scale of its blend.
  float reachedPart(const BlendSet& weights, float scale) const;

  const CapturedPairs& pairs() const { return pairs_; }
  // Irradiance of a captured light at the query's surfel.
  Rgb irradiance(size_t light) const { return rig_.lights().irradiance(light); }
  // irradianceRatio of `now` to the captured light.
  Rgb ratio(const Rgb& now, size_t light) const {
    const Eigen::Array4f ratio = rig_.lights().ratio({0, now.r, now.g, now.b}, light);
    return {ratio[1], ratio[2], ratio[3]};
  }

private:
  // What a light of a prepared query asks of kriging and tables.
  struct Prepared {
    float lightPenalty = kInfinity;
    std::optional<size_t> request; // in the batch of pairs; none where tables answer with a share of 1
    float share = 0;               // m
    PredictedRequest predicted;    // in the batch of residuals; if m > 0
  };

  void moveTo(size_t query);
  void prepareLights(size_t lane);
  RequestedLight requestedLight(size_t l) const;
  const Prepared& prepared() const { return prepared_[(query_ - begin_) * batch_.lights + light_]; }
  Blend finished(const BlendSet& weights, float lightPenalty, LightExtrapolation extrapolation) const;
  // Fade of a light where no light was captured, by the penalty of the nearest.
  float fadeOf(float lightPenalty, LightExtrapolation extrapolation) const;
  float foreshorteningOf(const BlendSet& blend, const RequestedLight& asked) const;
  float shareOfState(const BlendSet& weights, float reached) const;

  const ReflectanceField& field_;
  const LightExtrapolationFade& coverage_;
  const QueryBatch& batch_;
  const bool nearest_, foreshortened_;
  const bool isKriged_; // blend() is by kriging; else by ULR
  const size_t count_;  // number of pairs blended
  const float weightError_;
  const CapturedPairs pairs_;
  RigAtSurfel rig_;
  CameraWeights views_;
  std::optional<KrigingWeights> kriging_; // if it answers directional and point lights, or finds photographs
  std::optional<SharedWeights> shared_;   // if tables answer with it
  // Results for the prepared queries.
  std::array<BestView, kQueryLanes> bestViews_;
  std::vector<Prepared> prepared_; // light by light, query by query
  KrigingBatch pairBatch_, residuals_;
  // State of the selected light.
  size_t light_ = 0;
  RequestedLight asked_;
  std::vector<float> lightPenalties_; // p_j of all captured lights
  size_t begin_ = 0, query_ = 0;      // first prepared query; selected query
};

} // namespace surflect::weights
