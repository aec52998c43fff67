// The door of srf/: directions in acquisition space go in, radiance comes out.
#pragma once

#include "srf/model/shading_plan.h"

#include <functional>
#include <vector>

namespace surflect::model {

// Radiance per query of a plan, from the queue over the block store.
std::vector<Rgb> shade(const ShadingPlan& plan, codec::BlockCache& cache, codec::ShadingStats& stats,
                       const Progress& progress = {}, Simd simd = bestSimd());

struct Shaded {
  std::vector<Rgb> radiance;     // per query
  std::vector<float> confidence; // this and what follows: as ShadingPlan has it
  std::vector<Rgb> cameraBlend, lightBlend;
  size_t unseen = 0;
};

// Both in one. A few queries are planned and looked up by the same thread, so that what passes between the
// two stays in its caches; what waits for the disk is fetched for so many targets at a time, and a block that
// is asked for again later is read again where the cache does not keep it.
// `lap` hears how much of the processors' time since it last heard was planning, 0..1; the rest is look-ups.
Shaded shade(const Model& model, const QueryBatch& batch, const ShadeOptions& options,
             codec::BlockCache& cache, codec::ShadingStats& stats, const Progress& progress = {},
             const std::function<void(double planningShare)>& lap = {});

// Makes a batch of the queries from `begin` to before `end`, in its memory. Lights and environments are the
// same for all; first it is asked for them alone, with no query.
using FillBatch = std::function<void(size_t begin, size_t end, QueryBatch& batch)>;

// The same of queries that are made when they are due: no more of them are in memory than are answered at
// once.
Shaded shade(const Model& model, size_t queries, const FillBatch& fill, const ShadeOptions& options,
             codec::BlockCache& cache, codec::ShadingStats& stats, const Progress& progress = {},
             const std::function<void(double planningShare)>& lap = {});

} // namespace surflect::model
