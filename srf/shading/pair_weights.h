// Weights of (camera, light) pairs.
//
//   paper, separate:  p_ij = p_i + p_j,    w_ij by ULR over all pairs that were photographed
//   pairs:            p_ij = d_ij^2 / 2,   w_ij by ULR over the pairs of the nearest views and lights
//   kriging:                               w_ij by kriging over the nearest of these pairs (kriging.h)
//
// Symbols: p_i penalty of view i (camera_weights.h), p_j = 1 - cos of the angle at the surfel between
// captured light j and the light of the query, d_ij distance of a pair from the requested one (kriging.h),
// divided by the root of c_ij for pairs and by c_ij for kriging.  [Weyrich 2005, §5.2]
//
// c_ij = s_i n_i n_j is the confidence in a pair, 0..1: s_i visibility weight of view i, or
// fallbackConfidence (fallback_view.h) where no view sees the surfel well; n_i, n_j nearness of view and
// light, clamp(4 (1 - p / p_t), 0, 1) with the threshold p_t of ULR, so that the last of the nearest fade
// out.
//
// pairs and kriging need all lights from all cameras; other captures are weighted as under separate.
#pragma once

#include "srf/shading/camera_weights.h"
#include "srf/shading/light_weights.h"
#include "srf/ulr/kriging.h"
#include "srf/ulr/light_extrapolation.h"

#include <array>
#include <optional>
#include <vector>

namespace surflect::shading {

inline constexpr size_t kNearSources = 8; // nearest views, and lights, whose pairs are considered

// Scales of d_ij. Those of `pairs` give p_i + p_j + 64 p_h + 4 (difference of shadow states)^2, where p_h is
// 1 - cos of the angle between half vectors.
constexpr ulr::KrigingScales scalesOf(Interpolation interpolation) {
  if (interpolation != Interpolation::pairs) return {};
  return {.half = 0.125f, .light = 1, .view = 1, .shadow = 0.35355339f};
}

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
  };
  // The pairs for the l-th light of the query.
  Blend blend(size_t l);
  // The pairs for a light of an environment, whose shadow is not known.
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

  // The nearest views or lights; at least one, if there are any.
  struct NearSet {
    size_t size = 0;
    std::array<uint32_t, kNear> index;
    std::array<Direction3<AcquisitionSpace>, kNear> towards;
    std::array<float, kNear> confidence; // falls to 0 where one leaves the nearest
    std::array<float, kNear> reached;    // shadow states of lights
    void add(uint32_t source, const Direction3<AcquisitionSpace>& direction, float trust,
             float shadowState = 1) {
      index[size] = source;
      towards[size] = direction;
      confidence[size] = trust;
      reached[size++] = shadowState;
    }
  };
  // Light of a query, for which photographs are blended.
  struct LightQuery {
    Direction3<AcquisitionSpace> towards;
    ulr::LightExtrapolation extrapolation;
    std::optional<float> reached; // shadow state; empty: states are not used
  };

  Blend blendOf(const LightQuery& asked, const ulr::NearestCandidates& nearestLights);
  ulr::NearestCandidates nearestLights(const Direction3<AcquisitionSpace>& towards) const;
  void setNearViews(const ulr::NearestCandidates& nearest, const BestView& best);
  void setNearLights(const ulr::NearestCandidates& nearest, bool usesShadows);
  ulr::BlendSet separateBlend(const Direction3<AcquisitionSpace>& towards) const;
  // Squared distances of the pairs of nearViews_ and nearLights_ from the requested one, kNear for each view.
  std::array<float, kNear * kNear> squaredDistances(const LightQuery& asked) const;
  ulr::BlendSet nearBlend(const LightQuery& asked) const;
  float foreshorteningOf(const ulr::BlendSet& blend, const LightQuery& asked) const;
  float reachedBy(uint32_t light) const {
    return ulr::VisibilityWeights::decode(field_.lightVisibility->of(surfel_)[light]);
  }

  const ReflectanceField& field_;
  const ulr::LightExtrapolationFade& coverage_;
  const QueryBatch& batch_;
  const bool nearest_, weighsPairs_, isKriging_;
  const ulr::KrigingScales scales_;
  const bool foreshortened_;
  const size_t count_; // number of pairs blended
  const float weightError_;
  CameraWeights views_;
  CapturedLights lights_;
  ulr::NearestLights nearLightsOf_;
  std::vector<ulr::QueryBlends> nearestOfLight_; // per light of a query
  std::vector<Pair> pairs_;
  std::vector<size_t> firstPair_; // number of each view's first pair
  size_t begin_ = 0;
  // State of the selected query.
  size_t query_ = 0, lane_ = 0;
  uint32_t surfel_ = 0;
  Normal3<AcquisitionSpace> normal_;
  NearSet nearViews_, nearLights_;
};

} // namespace surflect::shading
