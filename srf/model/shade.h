// The door of srf/: directions in acquisition space go in, radiance comes out.
#pragma once

#include "srf/model/model.h"
#include "srf/query/environment.h"
#include "srf/query/light_table.h"
#include "srf/store/shading_queue.h"

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace surflect {

// An environment that lights all queries of a batch.
struct QueryEnvironment {
  std::span<const EnvironmentLight> lights;
  Rgb strength{1, 1, 1}; // of them all
  Uncovered uncovered = Uncovered::fade;
  const LightTable* table = nullptr; // see lightTable; without it every light is answered by ULR of its own
};

// What is asked of a model, as arrays; everything in acquisition space.
struct QueryBatch {
  size_t lights = 0;                                     // per query
  std::vector<uint32_t> surfels;                         // one per query
  std::vector<Direction3<AcquisitionSpace>> towardsView; // one per query; unit
  // Row by row, `lights` per query: unit direction to the light, and the irradiance on a surface facing it.
  std::vector<Direction3<AcquisitionSpace>> towardsLight;
  std::vector<Rgb> irradiance;
  std::vector<Uncovered> uncovered; // one per light of a query; none: they extrapolate
  std::vector<QueryEnvironment> environments;
  // Row by row, one per environment: L after the environment's own place in the world.
  std::vector<Turn<AcquisitionSpace, EnvironmentSpace, float>> acquisitionFromEnvironment;

  size_t size() const { return surfels.size(); }
};

struct ShadeOptions {
  size_t cameras = 3; // blended per query, 1..kMaxBlended
  size_t pairs = 4;   // (camera, light) pairs blended instead, where the capture is not a full product
  // Instead of the model's own blend of lights, which pack has chosen; see LightBlend.
  std::optional<size_t> lights = {};
  std::optional<LightFit> lightFit = {};
  std::optional<bool> foreshortened = {};
  // The baseline: the nearest camera that sees the surfel, then its nearest light (or the nearest pair),
  // without any fading.
  bool nearest = false;
};

// What the options say, or else the model.
LightBlend lightBlend(const Model& model, const ShadeOptions& options);

// One operation per query and camera, its lights folded into a row of weights. Which cameras and lights were
// blended is kept for those who want to see it.
struct ShadingPlan {
  size_t queries = 0;
  // A target per query; where pairs are blended one per query and light or environment, so that an operation
  // which shows background is made up for by others of its light.
  size_t targetsPerQuery = 1;
  std::vector<ShadingOp> ops;
  std::vector<LightWeight> rows;
  // Colours of their own for cameras and lights, blended as they are [Weyrich 2005, Fig. 16]; one per query.
  std::vector<Rgb> cameraBlend, lightBlend;
  size_t unseen = 0; // queries that no camera sees: others stand in (stand_in.h)
};

// Radians between neighbouring lights of the rig, as LightCoverage has it.
double lightSpacing(const Model& model);

// For the environments of queries to this model, with these options; nothing where weights depend on more
// than the direction: lights near the object, or a capture that is not a full product.
std::optional<LightTable> lightTable(const Model& model, const ShadeOptions& options, Uncovered uncovered);

// Throws Error when lights are asked of a capture with fixed illumination, or none of one without.
ShadingPlan planShading(const Model& model, const QueryBatch& batch, const ShadeOptions& options,
                        const Progress& progress = {});

// Radiance per query, from the queue over the block store.
std::vector<Rgb> shade(const ShadingPlan& plan, BlockCache& cache, ShadingStats& stats,
                       const Progress& progress = {});

// Both in one.
std::vector<Rgb> shade(const Model& model, const QueryBatch& batch, const ShadeOptions& options,
                       BlockCache& cache, ShadingStats& stats, const Progress& progress = {});

} // namespace surflect
