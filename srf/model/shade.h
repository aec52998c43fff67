// The door of srf/: directions in acquisition space go in, radiance comes out.
#pragma once

#include "srf/model/shading_plan.h"

namespace surflect {

// Radiance per query, from the queue over the block store.
std::vector<Rgb> shade(const ShadingPlan& plan, BlockCache& cache, ShadingStats& stats,
                       const Progress& progress = {});

// Both in one.
std::vector<Rgb> shade(const Model& model, const QueryBatch& batch, const ShadeOptions& options,
                       BlockCache& cache, ShadingStats& stats, const Progress& progress = {});

} // namespace surflect
