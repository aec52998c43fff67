// From queries to operations: the weights of cameras and lights become look-ups for the shading queue.
//
//   radiance[query] = sum over views i  w_i  sum over lights l  w_l  X_il(x_i)
//
// Symbols: w_i weight of view i (camera_weights.h), w_l weight of captured light l (light_weights.h), X_il
// the reflectance image of both, x_i the surfel's place in it.  [Weyrich 2005, §5.2 and §5.3] A capture with
// gaps has one weight for each pair (pair_weights.h).
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
  size_t queries = 0;
  // Pairs have a target per query and light or environment, so that an operation which shows background is
  // made up for by others of the same light.
  size_t targetsPerQuery = 1;
  std::vector<ShadingOp> ops;
  LightRows rows;
  // Per query: confidence in its best view (ulr.h), whatever that view shows and however far its lights are.
  std::vector<float> confidence;
  // Per query, if the options show them: blendColors of cameras and lights, blended by their weights.
  std::vector<Rgb> cameraBlend, lightBlend;
  size_t unseen = 0; // queries that are answered by fallback views alone

  size_t targets() const { return queries * targetsPerQuery; }
  ShadingPart part() const { return {ops, &rows, targets()}; }
};

class ShadingPlanner {
public:
  // Field and batch must outlive the planner. Throws Error when lights are asked of a capture with fixed
  // illumination, or none of one without; and when foreshortening is asked of a capture that is not a full
  // product.
  ShadingPlanner(const ReflectanceField& field, const QueryBatch& batch, const ShadeOptions& options);
  ~ShadingPlanner();

  size_t targetsPerQuery() const; // of every plan
  size_t queriesPerPlan() const;  // that keep a plan in the processor's cache

  // Plans the queries [begin, end) of the batch, with targets from 0 on, in the plan's memory. Safe from many
  // threads at once.
  void plan(size_t begin, size_t end, ShadingPlan& plan);

private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// One plan of the whole batch, by this thread alone.
ShadingPlan planShading(const ReflectanceField& field, const QueryBatch& batch, const ShadeOptions& options);

} // namespace surflect::shading
