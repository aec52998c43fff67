// Shading plan: turns queries into look-ups of the shading queue, weighted by cameras and lights.
//
//   radiance[query] = sum over views i  w_i a_i(x_i)  sum over lights l  w_l  X_il(x_i)
//   alpha[query] = sum over views i  w_i a_i(x_i)
//
// Symbols: w_i weight of view i (camera_weights.h), w_l weight of captured light l (light_weights.h), X_il
// their reflectance image, x_i projection of the surfel in view i.  [Weyrich 2005, §5.2 and §5.3] A capture
// with gaps has one weight for each pair (pair_weights.h). a_i is the alpha of view i, 1 for an opaque
// object: radiance is premultiplied by alpha, since photographs are blended over one background.
#pragma once

#include "srf/shading/light_weights.h"
#include "srf/shading/operations.h"
#include "srf/shading/query.h"
#include "srf/shading/reflectance_field.h"

#include <cstddef>
#include <memory>
#include <vector>

namespace surflect::shading {

struct ShadingPlan {
  size_t places = 0; // of all planned queries
  // With pairs, each light or environment of a place has a target of its own, so that an operation which
  // shows background is compensated by others of the same light.
  size_t targetsPerPlace = 1;
  std::vector<ShadingOp> ops;
  LightRows rows;
  // One per place: confidence (ulr.h) of its best view. Lights, and texels missing from that view, do not
  // affect it.
  std::vector<float> confidence;
  // One per place, if the field has alpha and the options use it: blended alpha, the mean over targets.
  std::vector<float> alpha;
  struct AlphaSum {
    float alpha = 0, weight = 0; // sums of w_i a_i and of w_i
  };
  std::vector<AlphaSum> alphaSums; // one per target, if there is alpha
  // One per place, if the options show blends: weighted means of blendColors of cameras and lights.
  std::vector<Rgb> cameraBlend, lightBlend;
  size_t unseen = 0;           // places with fallback views only
  size_t unmatchedShadows = 0; // places and lights for which few photographs have the requested shadow state

  size_t targets() const { return places * targetsPerPlace; }
  ShadingPart part() const { return {ops, &rows, targets()}; }
};

class ShadingPlanner {
public:
  // Field and batch must outlive the planner. Throws Error if a capture with fixed illumination is queried
  // with lights, if any other capture is queried without lights, or if foreshortening is requested for a
  // capture that is not a full product.
  ShadingPlanner(const ReflectanceField& field, const QueryBatch& batch, const ShadeOptions& options);
  ~ShadingPlanner();

  size_t targetsPerPlace() const; // the same for every plan
  size_t queriesPerPlan() const;  // the most that keep a plan in the processor's cache

  // Plans the queries [begin, end) of the batch into `plan`, reusing its memory; targets count from 0. Safe
  // from many threads at once.
  void plan(size_t begin, size_t end, ShadingPlan& plan);

private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Plans the whole batch in the calling thread.
ShadingPlan planShading(const ReflectanceField& field, const QueryBatch& batch, const ShadeOptions& options);

} // namespace surflect::shading
