// Shading plan: turns queries into look-ups of the shading queue, weighted by cameras and lights.
//
//   radiance[query] = sum over views i  w_i a_i(x_i)  sum over lights l  w_l  X_il(x_i)
//   alpha[query] = sum over views i  w_i a_i(x_i)
//
// Symbols: w_i weight of view i (camera_weights.h), w_l weight of captured light l (light_weights.h), X_il
// their reflectance image, x_i projection of the surfel in view i, a_i alpha of view i, 1 for an opaque
// object. Radiance is premultiplied by alpha, since photographs are blended over one background. [Weyrich
// 2005, §5.2 and §5.3]
//
// Where cameras and lights are not weighted apart (pair_weights.h), w_il stands for w_i w_l. Where tables
// answer with them (shared_weights.h), a place has further targets: one for each light, of the photographs
// that correct the tables. Tables add a colour to these targets, and to those of environments.
#pragma once

#include "srf/shading/kept_look_ups.h"
#include "srf/weights/light_table.h"
#include "srf/weights/query.h"
#include "srf/weights/reflectance_field.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace surflect::shading {

// Operations of the shading queue, after [Weyrich 2005, Table 2]. An operation of the paper is one look-up
// for a surfel, camera and light. Here, an operation has one camera and all lights: the lights share a
// position in the image, hence blocks and texels. Light weights are applied to the factor A of X ~ E A before
// any texel is read.
struct ShadingOp {
  uint32_t target = 0; // index of the radiance that the operation adds to
  uint32_t view = 0;   // index of the view
  float x = 0, y = 0;  // projection of the surfel in pixels, centres at +0.5; clamped to the image
  float weight = 0;    // camera weight
  uint32_t rowBegin = 0, rowEnd = 0; // light row: a range of weights::LightRows::lights
};

// An operation and its slot of KeptLookUps.
struct KeptOp {
  uint32_t op, slot;
};

// Operations that can be executed independently of others. The rows must outlive the part.
struct ShadingPart {
  std::span<const ShadingOp> ops;
  const weights::LightRows* rows = nullptr;
  size_t targets = 0;
  // If not null, operations take their radiance from its slots, or bring it there.
  KeptLookUps* kept = nullptr;
  std::span<const KeptOp> known = {}, asked = {}; // all operations
};

struct ShadingPlan {
  size_t places = 0; // of all planned queries
  // 1, or with weights of pairs the number of lights and environments: each then has a target of its own at
  // every place, and an operation that shows background is compensated by operations of the same light. With
  // tables, a second target of each light follows.
  size_t targetsPerPlace = 1;
  size_t tablesPerPlace = 0; // how many of them, the last ones, belong to tables: one for each light
  // With tables, one per place and light: share m of the tables in the answer.
  std::vector<float> tableShares;
  // With tables, one per target: radiance that is added to that of the photographs. The sum of both is
  // clamped to 0 from below.
  std::vector<Rgb> offsets;
  std::vector<ShadingOp> ops;
  weights::LightRows rows;
  KeptLookUps* kept = nullptr;      // as in ShadingPart
  std::vector<KeptOp> known, asked; // likewise
  // One per place: confidenceOf (ulr.h) its best view's penalty. Neither lights nor missing texels affect it.
  std::vector<float> confidence;
  // One per place, if the field has alpha and the options use it: blended alpha, the mean over targets.
  std::vector<float> alpha;
  struct AlphaSum {
    float alpha = 0, weight = 0; // sums of w_i a_i and of w_i
  };
  std::vector<AlphaSum> alphaSums; // one per target, if there is alpha
  // One per place, if the options show blends: weighted means of blendColors of cameras and lights.
  std::vector<Rgb> cameraBlend, lightBlend;
  size_t unseen = 0; // places with fallback views only
  // Number of places and lights for which few photographs have the requested shadow state; and, if the
  // options show targets, each of them: place * lights + light.
  size_t unmatchedShadows = 0;
  std::vector<uint32_t> unmatchedAt;

  size_t targets() const { return places * targetsPerPlace; }
  ShadingPart part() const { return {ops, &rows, targets(), kept, known, asked}; }
};

// Adds the offsets of a plan to the radiance of its targets.
void addOffsets(const ShadingPlan& plan, std::span<Rgb> radiance);

// Sets the alpha of each place to the mean over its targets, of which those without a look-up do not count.
void meanAlpha(ShadingPlan& plan);

class ShadingPlanner {
public:
  // Field and batch must outlive the planner. Throws Error if a capture with fixed illumination is queried
  // with lights, if any other capture is queried without lights, or if foreshortening is requested for a
  // capture with gaps that kriging does not answer.
  ShadingPlanner(const weights::ReflectanceField& field, const weights::QueryBatch& batch,
                 const weights::ShadeOptions& options);
  ~ShadingPlanner();

  size_t targetsPerPlace() const; // the same for every plan
  size_t queriesPerPlan() const;  // the most that keep a plan in the processor's cache

  // Plans the queries [begin, end) of the batch into `plan`, reusing its memory; targets count from 0. Safe
  // from many threads at once.
  void plan(size_t begin, size_t end, ShadingPlan& plan);

  // True if cameras and lights have separate weights for all queries, so that plans can be relit.
  bool canRelight() const;
  // Plans the queries [begin, end) as plan() does, from a plan of queries that differ in nothing but the
  // directions and irradiance of their lights. Look-ups and weights of cameras are those of that plan.
  void relight(size_t begin, size_t end, ShadingPlan& plan);
  // Plans them as plan() does, but for the light rows of surfels whose look-ups are all known. For plans that
  // can be relit, without environments; `kept` has begun with the batch and options.
  void planKept(size_t begin, size_t end, ShadingPlan& plan, KeptLookUps& kept);

private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

// Plans the whole batch in the calling thread.
ShadingPlan planShading(const weights::ReflectanceField& field, const weights::QueryBatch& batch,
                        const weights::ShadeOptions& options);

} // namespace surflect::shading
