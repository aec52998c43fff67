// Weights of (camera, light) pairs, for captures in which not every view has every light.
//
//   p_ij = p_i + p_j     w_ij by ULR over all pairs that were photographed  [Weyrich 2005, §5.2]
//
// Symbols: p_i penalty of view i (camera_weights.h), p_j = 1 - cos of the angle at the surfel between
// captured light j and the light of the query.
#pragma once

#include "srf/shading/camera_weights.h"
#include "srf/shading/light_weights.h"
#include "srf/ulr/light_extrapolation.h"

#include <vector>

namespace surflect::shading {

// Computes the pair weights of one query after another. Has working memory of its own: use one object per
// thread.
class PairWeights {
public:
  // The arguments must outlive the weights.
  PairWeights(const ReflectanceField& field, const ulr::LightExtrapolationFade& coverage,
              const QueryBatch& batch, const ShadeOptions& options);

  // Selects a query for the methods below, and computes its p_i.
  BestView prepare(size_t query);

  struct Blend {
    ulr::BlendSet weights; // index is the number of a pair
    float covered;         // fade where no light was captured (light_extrapolation.h)
  };
  Blend blend(const Direction3<AcquisitionSpace>& towardsLight, ulr::LightExtrapolation extrapolation);

  const Point3<AcquisitionSpace, double>& place() const { return lights_.place(); }
  // Irradiance of a captured light at the query's surfel.
  Rgb irradiance(size_t light) const { return lights_.irradiance(light); }

  // A (camera, light) pair. Pairs are numbered view by view, in the order of columns.
  struct Pair {
    uint32_t view, column, light;
  };
  Pair pair(uint32_t number) const;
  size_t firstPairOf(size_t view) const { return firstPair_[view]; }
  size_t size() const { return pairs_; }

private:
  const ReflectanceField& field_;
  const ulr::LightExtrapolationFade& coverage_;
  const QueryBatch& batch_;
  const bool nearest_;
  const size_t count_; // number of pairs blended
  const float weightError_;
  CameraWeights views_;
  CapturedLights lights_;
  std::vector<float> lightPenalty_; // p_j, for the last light direction blended
  std::vector<size_t> firstPair_;   // number of each view's first pair
  size_t pairs_ = 0;
};

} // namespace surflect::shading
