// Kriging weights of photographs for a light of a query: the (camera, light) pairs that are kriged
// (kriging.h), and the confidence in each.
//
//   p_ij = d_ij (1 + t_j) / c_ij,   w_ij by kriging over the pairs of least p_ij
//
// Symbols: d_ij distance of the pair of view i and light j from the requested pair without shadow states,
// t_j difference of their shadow states in scales; c_ij = s_i n_i n_j confidence in a pair, 0..1: s_i
// visibility weight of view i, or fallbackConfidence (fallback_view.h) where no view sees the surfel well;
// n_i, n_j nearness of view and light to the requested directions.
//
// Full product: the pairs of the nearest views and lights are considered. Few gaps: all other pairs fade in
// where the best near pairs were not photographed. Let c be the greatest confidence among near pairs that
// were photographed, c' that among all near pairs, and g = max(0, 1 - 2 c / c'). Every photographed pair then
// has a confidence of at least g s_i: g is 0 as long as a near pair with half of c' was photographed, and
// grows to 1 as the photographed near pairs lose their confidence. Wide gaps (hasNearPairs): all photographed
// pairs are considered, with n_i = n_j = 1.
//
// Pairs with camera and light exchanged are considered, too, if they answer (reciprocity.h).
#pragma once

#include "srf/weights/camera_weights.h"
#include "srf/weights/nearest_pairs.h"
#include "srf/weights/reciprocity.h"

#include <optional>
#include <vector>

namespace surflect::weights {

// Light of a query, for which photographs are blended.
struct RequestedLight {
  Direction3<AcquisitionSpace> towards;
  std::optional<float> reached; // shadow state; empty: states are not used

  float state() const { return reached.value_or(1); }
};

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

  struct Blend {
    BlendSet weights; // index is the number of a pair
    // Penalty of the captured light nearest to the requested one.
    float lightPenalty = kInfinity;
  };
  // The pairs for the l-th light of the selected query.
  Blend blend(size_t l, const RequestedLight& asked);

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
  float shareOfAllPairs() const; // g
  void noteNearConfidences(const NearPairs& pairs);
  void leaveOutMissing(const NearPairs& pairs, float* penalties) const;
  BlendSet nearBlend(const RequestedLight& asked) const;
  BlendSet allBlend(const RequestedLight& asked, float share) const;
  // Weights of the nearest of the candidates, whose numbers become those of pairs.
  template <class CandidateAt>
  BlendSet weightsOf(const NearestCandidates& nearest, const PairPlace& requested,
                     const CandidateAt& candidateAt) const;

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
  NearPairs near_, exchanged_;
  std::vector<Direction3<AcquisitionSpace>> towardsViews_; // all, where all pairs are considered
  std::vector<float> confidences_;                         // in these views
  std::vector<float> nearConfidences_; // c_ij of photographed near pairs, else 0; by number, then exchanged
};

} // namespace surflect::weights
