// Weights of (camera, light) pairs.
//
//   paper, separate:  p_ij = p_i + p_j,    w_ij by ULR over all pairs that were photographed
//   pairs:            p_ij = (d_ij^2 + t_j^2) / (2 c_ij),   w_ij by ULR
//   kriging:          p_ij = d_ij (1 + t_j) / c_ij,         w_ij by kriging over the pairs of least p_ij
//
// The last two consider the pairs of the nearest views and lights, or all if the capture has wide gaps
// (near_pairs.h).
//
// Symbols: p_i penalty of view i (camera_weights.h), p_j = 1 - cos of the angle at the surfel between
// captured light j and the light of the query [Weyrich 2005, §5.2]; d_ij distance of a pair from the
// requested one without shadow states (kriging.h), t_j difference of their shadow states in scales.
//
// c_ij = s_i n_i n_j is the confidence in a pair, 0..1: s_i visibility weight of view i, or
// fallbackConfidence (fallback_view.h) where no view sees the surfel well; n_i, n_j nearness of view and
// light, 1 up to a quarter of the threshold p_t of ULR, then falling evenly to 0 at p_t. It falls slowly,
// since neighbouring photographs can differ by a whole highlight: weight moves from one to the next while a
// lamp crosses the gap between captured lights. n_i = n_j = 1 for a capture with wide gaps.
//
// Few gaps: where the best of the near pairs were not photographed, all other pairs fade in. Their confidence
// is then at least g s_i, with g = 1 - 2 c / c', the greatest confidence c of the near pairs that were
// photographed and c' of all near pairs.
//
// Reciprocity: under kriging, the photograph of camera a under light b also answers for the light in the
// place of a and the viewer in that of b [Helmholtz 1867]. Its pixel holds the cosine of b, which
// foreshortening replaces; its nugget is larger by kReciprocalNugget. It shows a lit surfel: its confidence
// falls with both shadow states and the cosine of b.
//
// [Helmholtz 1867] Helmholtz: Handbuch der physiologischen Optik.
#pragma once

#include "srf/shading/camera_weights.h"
#include "srf/shading/light_weights.h"
#include "srf/shading/pair_kernels.h"
#include "srf/ulr/kriging.h"
#include "srf/ulr/light_extrapolation.h"

#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace surflect::shading {

inline constexpr float kReciprocalNugget = 0.02f;
inline constexpr float kNearUpTo = 0.25f; // p / p_t up to which views and lights are near: n = 1

// Scales of d_ij. Those of `pairs` give p_i + p_j + 64 p_h + 4 (difference of shadow states)^2, where p_h is
// 1 - cos of the angle between half vectors.
//
// Under kriging, they depend on the requested shadow state. The model's scale of half vectors is that of lit
// surfels. A surfel in shadow has no highlight of the light, and shows light from its surroundings, which
// changes evenly with all directions; its scales are fixed.
ulr::KrigingScales scalesOf(const ReflectanceField& field, const ShadeOptions& options, float reached);

// True if photographs also answer for camera and light exchanged. Needs foreshortening.
bool isReciprocal(const ReflectanceField& field, const ShadeOptions& options);

// Penalty of a pair before division by its confidence. `squared` is its squared distance without shadow
// states, `statesApart` the difference of the shadow states in scales. Under kriging, pairs of another shadow
// state are penalised, but keep their order by angle.
inline float krigingPenalty(float squared, float statesApart) {
  return std::sqrt(squared) * (1 + statesApart);
}
inline float pairPenalty(float squared, float statesApart) {
  return (squared + statesApart * statesApart) / 2;
}

// Confidence in a light b as the viewer of an exchanged pair, by its cosine at the surfel and the part of b
// that reaches the surfel.
float exchangedConfidence(float cosine, float reached);

// Computes the pair weights of one query after another. Has working memory of its own: use one object per
// thread.
class PairWeights {
public:
  // The arguments must outlive the weights.
  PairWeights(const ReflectanceField& field, const ulr::LightExtrapolationFade& coverage,
              const QueryBatch& batch, const ShadeOptions& options);

  // Finds the views and lights nearest to the queries from `begin` on (1..kQueryLanes), in vector lanes.
  void prepare(size_t begin, size_t count);
  // Selects the lane-th prepared query for the methods below.
  BestView select(size_t lane);

  struct Blend {
    ulr::BlendSet weights; // index is the number of a pair, ascending
    float scale = 1;       // fade where no light was captured (light_extrapolation.h), times foreshortening
    // True if photographs of the requested shadow state have less than half of the weights.
    bool lacksState = false;
  };
  // The pairs for the l-th light of the query.
  Blend blend(size_t l);
  // The pairs for a light of an environment, by the penalties of cameras and lights apart, for a capture with
  // gaps.
  Blend blendTowards(const Direction3<AcquisitionSpace>& towards, ulr::LightExtrapolation extrapolation);

  // Irradiance of a captured light at the query's surfel.
  Rgb irradiance(size_t light) const { return lights_.irradiance(light); }
  // irradianceRatio of `now` to that.
  Rgb ratio(const Rgb& now, size_t light) const {
    const Eigen::Array4f ratio = lights_.ratio({0, now.r, now.g, now.b}, light);
    return {ratio[1], ratio[2], ratio[3]};
  }

  // A (camera, light) pair. Pairs are numbered view by view, in the order of columns.
  struct Pair {
    uint32_t view, column, light;
  };
  Pair pair(uint32_t number) const { return pairs_[number]; }
  size_t firstPairOf(size_t view) const { return firstPair_[view]; }
  size_t size() const { return pairs_.size(); }

private:
  static constexpr size_t kNear = kNearSources;
  static constexpr uint32_t kMissing = 0xffffffff; // number of a pair that was not photographed

  // Light of a query, for which photographs are blended.
  struct LightQuery {
    Direction3<AcquisitionSpace> towards;
    ulr::LightExtrapolation extrapolation;
    std::optional<float> reached; // shadow state; empty: states are not used
  };
  // A pair that may be blended.
  struct Candidate {
    uint32_t number;
    ulr::PairPlace place;
    float confidence, nugget; // nugget in addition to nuggetOf
  };

  // Candidates: the pairs of each viewer with each light, numbered as in pair_kernels.h.
  struct NearPairs {
    NearSources viewers, lights;

    float confidence(size_t pair) const {
      return viewers.confidence[pair / kPairLanes] * lights.confidence[pair % kPairLanes];
    }
    ulr::PairPlace place(size_t pair, const ulr::KrigingScales& scales) const {
      const size_t light = pair % kPairLanes;
      return ulr::pairPlace(assume<Direction3<AcquisitionSpace>>(lights.towards(light)),
                            assume<Direction3<AcquisitionSpace>>(viewers.towards(pair / kPairLanes)),
                            lights.reached[light], scales);
    }
  };

  Blend blendOf(ulr::BlendSet weights, const LightQuery& asked, const ulr::NearestCandidates& nearestLights,
                bool isForeshortened) const;
  float shareOfState(const ulr::BlendSet& weights, float reached) const;
  ulr::KrigingScales scalesFor(const LightQuery& asked) const;
  // Also computes lightPenalties_.
  ulr::NearestCandidates nearestLights(const Direction3<AcquisitionSpace>& towards);
  float confidenceIn(uint32_t view, const Direction3<AcquisitionSpace>& towards, float penalty,
                     const BestView& best) const;
  void setNearViews(const ulr::NearestCandidates& nearest, const BestView& best);
  void setAllViews(const BestView& best);
  void setNearLights(const ulr::NearestCandidates& nearest, bool usesShadows);
  void setExchanged(size_t l, std::optional<float> requested);
  ulr::BlendSet separateBlend() const;
  RequestedPair requestedPair(const LightQuery& asked, const ulr::KrigingScales& scales) const;
  // Number of the pair of a viewer and a light, kMissing if it was not photographed.
  uint32_t numberOf(const NearPairs& pairs, size_t viewer, size_t light) const {
    const uint32_t a = pairs.viewers.index[viewer], b = pairs.lights.index[light];
    const auto [ofView, ofLight] = &pairs == &exchanged_ ? std::pair(b, a) : std::pair(a, b);
    return numbers_[ofView * lights_.size() + ofLight];
  }
  // Confidences of near pairs, by viewer and light; 0 for those that are not near.
  struct ConfidenceOfAll {
    std::vector<float> viewers, lights;
  };
  static ConfidenceOfAll confidenceOfAll(const NearPairs& pairs, size_t viewers, size_t lights);
  // g
  float shareOfAllPairs() const;
  // Makes the penalties of missing pairs infinite.
  void leaveOutMissing(const NearPairs& pairs, float* penalties) const;
  ulr::BlendSet nearBlend(const LightQuery& asked) const;
  ulr::BlendSet allBlend(const LightQuery& asked, float share) const;
  // Weights of the nearest of the candidates, whose numbers become those of pairs.
  template <class CandidateAt>
  ulr::BlendSet weightsOf(const ulr::NearestCandidates& nearest, const LightQuery& asked,
                          const ulr::KrigingScales& scales, const CandidateAt& candidateAt) const;
  float penaltyOf(float squared, float statesApart) const {
    return isKriging_ ? krigingPenalty(squared, statesApart) : pairPenalty(squared, statesApart);
  }
  float foreshorteningOf(const ulr::BlendSet& blend, const LightQuery& asked) const;
  float reachedBy(uint32_t light) const {
    return ulr::VisibilityWeights::decode(field_.lightVisibility->of(surfel_)[light]);
  }

  const ReflectanceField& field_;
  const ulr::LightExtrapolationFade& coverage_;
  const QueryBatch& batch_;
  const ShadeOptions options_;
  const bool nearest_, weighsPairs_, isSparse_, isKriging_; // sparse: a capture with wide gaps
  const ulr::KrigingScales litScales_, shadowScales_;
  const bool foreshortened_, reciprocal_;
  const size_t count_; // number of pairs blended
  const float weightError_;
  CameraWeights views_;
  CapturedLights lights_;
  ulr::NearestLights nearLightsOf_;
  std::vector<ulr::QueryBlends> nearestOfLight_; // per light of a query
  // For exchanged pairs: lights nearest to the viewer, and views nearest to each light of a query.
  ulr::QueryBlends nearestOfView_;
  std::vector<ulr::NearestViews> viewsNearLight_;
  std::vector<const ulr::QueryBlends*> nearestViewsOfLight_;
  std::vector<Pair> pairs_;
  std::vector<size_t> firstPair_; // number of each view's first pair
  std::vector<uint32_t> numbers_; // of pairs or kMissing, by view and light
  size_t begin_ = 0;
  // State of the selected query.
  size_t query_ = 0, lane_ = 0;
  uint32_t surfel_ = 0;
  Normal3<AcquisitionSpace> normal_;
  std::vector<float> lightPenalties_;                      // p_j of all captured lights
  std::vector<Direction3<AcquisitionSpace>> towardsViews_; // all, where all pairs are considered
  std::vector<float> confidences_;                         // in these views
  ConfidenceOfAll nearOfAll_, exchangedOfAll_;
  NearPairs near_;
  NearPairs exchanged_; // lights of the rig as viewers, and views as lights
};

} // namespace surflect::shading
