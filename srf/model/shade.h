// The door of srf/: directions in acquisition space go in, radiance comes out.
#pragma once

#include "srf/model/shading_plan.h"

#include <functional>
#include <string_view>
#include <vector>

namespace surflect {

// Radiance per query of all plans, from the queue over the block store.
std::vector<Rgb> shade(std::span<const ShadingPlan> plans, BlockCache& cache, ShadingStats& stats,
                       const Progress& progress = {}, Simd simd = bestSimd());
inline std::vector<Rgb> shade(const ShadingPlan& plan, BlockCache& cache, ShadingStats& stats,
                              const Progress& progress = {}, Simd simd = bestSimd()) {
  return shade(std::span(&plan, 1), cache, stats, progress, simd);
}

struct Shaded {
  std::vector<Rgb> radiance;                // per query
  std::vector<Rgb> cameraBlend, lightBlend; // and unseen: as ShadingPlan has them
  size_t unseen = 0;
};

inline constexpr size_t kTargetsAtOnce = 1 << 14;

// Both in one. Queries are planned and looked up for so many targets at a time, so that what passes between
// the two stays in the processor's caches; a block that several parts ask for is read again where the cache
// does not keep it. The answer does not depend on it. `finished` hears "ulr" after each part's planning and
// "shade" after its look-ups.
Shaded shade(const Model& model, const QueryBatch& batch, const ShadeOptions& options, BlockCache& cache,
             ShadingStats& stats, const Progress& progress = {},
             const std::function<void(std::string_view)>& finished = {},
             size_t targetsAtOnce = kTargetsAtOnce);

} // namespace surflect
