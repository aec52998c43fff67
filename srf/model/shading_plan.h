// Which photographs answer a query, and how much of each: cameras and lights by unstructured lumigraph
// rendering, folded into operations of the shading queue.
#pragma once

#include "srf/codec/shading_queue.h"
#include "srf/model/model.h"
#include "srf/model/query_batch.h"
#include "surfel/math/simd.h"

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

namespace surflect::model {

inline constexpr size_t kTargetsAtOnce = 1 << 14;

struct ShadeOptions {
  size_t cameras = 3; // blended per query, 1..kMaxBlended
  size_t pairs = 4;   // (camera, light) pairs blended instead, where the capture is not a full product
  // Instead of the model's own blend of lights, which pack has chosen; see LightBlend.
  std::optional<size_t> lights = {};
  std::optional<ulr::LightFit> lightFit = {};
  std::optional<bool> foreshortened = {};
  // The baseline: the nearest camera that sees the surfel, then its nearest light (or the nearest pair),
  // without any fading.
  bool nearest = false;
  // avx2 and avx512 give the same bits; scalar differs by roundings, see choice_lanes.h, look_up_kernel.h.
  Simd simd = bestSimd();
  bool showsBlends = false;              // Shaded has colours of cameras and lights
  size_t targetsAtOnce = kTargetsAtOnce; // that shade answers together; the answer does not depend on it
};

// What the options say, or else the model.
ulr::LightBlend lightBlend(const Model& model, const ShadeOptions& options);

// For some queries: one operation per query and camera, its lights folded into a row of weights.
struct ShadingPlan {
  size_t queries = 0;
  // A target per query; where pairs are blended one per query and light or environment, so that an operation
  // which shows background is made up for by others of its light.
  size_t targetsPerQuery = 1;
  std::vector<codec::ShadingOp> ops;
  codec::LightRows rows;
  // Per query, by its best view alone (ulr.h): whether that turns out to show background there, and how far
  // the light is, are not looked at.
  std::vector<float> confidence;
  // Colours of their own for cameras and lights, blended as they are [Weyrich 2005, Fig. 16]; one per query,
  // none where the options do not ask for them.
  std::vector<Rgb> cameraBlend, lightBlend;
  size_t unseen = 0; // queries that no camera sees: others stand in (fallback_view.h)

  size_t targets() const { return queries * targetsPerQuery; }
};

// A light's weight: what falls on the surface now over what fell when the photograph was taken, channel by
// channel; 0 where nothing fell then.
Rgb irradianceRatio(Rgb now, Rgb captured);

// Radians between neighbouring lights of the rig, as LightCoverage has it.
double lightSpacing(const Model& model);

// For the environments of queries to this model, with these options; nothing where weights depend on more
// than the direction: lights near the object, or a capture that is not a full product.
std::optional<ulr::LightTable> lightTable(const Model& model, const ShadeOptions& options,
                                          ulr::LightExtrapolation extrapolation);

// Plans a few queries at a time, by many threads at once; holds what it would otherwise allocate anew.
class ShadingPlanner {
public:
  // Throws Error when lights are asked of a capture with fixed illumination, or none of one without; and when
  // it is to be foreshortened and is not a full product of cameras and lights. Model and batch must outlive
  // the planner.
  ShadingPlanner(const Model& model, const QueryBatch& batch, const ShadeOptions& options);
  ~ShadingPlanner();

  size_t targetsPerQuery() const; // of every plan

  // The queries from `begin` to before `end` make so many plans.
  size_t split(size_t begin, size_t end);

  // Of these the i-th, in order; targets count from 0 in each. Each is asked for once; by many threads at a
  // time. Valid until the next split.
  const ShadingPlan& plan(size_t i);

  // Of the whole batch, by this thread alone.
  ShadingPlan planAll();

private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

// The same in one call.
ShadingPlan planShading(const Model& model, const QueryBatch& batch, const ShadeOptions& options);

} // namespace surflect::model
