// Samples a mesh evenly by surfels.
#pragma once

#include "surfel/base/time.h"
#include "surfel/cloud.h"
#include "surfel/geometry/mesh.h"

#include <cstdint>

namespace surflect {

// Sigma of a splat's Gaussian over its radius.
inline constexpr float kSigmaPerRadius = 0.6f;

// Samples surfels about `spacing` apart (scene units), as in a hexagonal grid: a Poisson-disk set relaxed by
// Lloyd's method. Sheets are distinguished by their normals, so that both sides of thin walls and sharp edges
// are covered. radius is the mean distance to the six nearest neighbours. coverage makes the Gaussians add up
// to 1 at every surfel, and fall to 1/2 at the border of a sheet, so that outlines stay in place. Sorted
// along a space-filling curve. Cost: O(area / spacing^2).
SurfelCloud sampleSurfels(const TriangleMesh& mesh, double spacing, uint64_t seed = 1,
                          const Progress& progress = {});

// Approximate number of surfels that sampleSurfels yields.
double surfelsAt(const TriangleMesh& mesh, double spacing);

// Spacing at which sampleSurfels yields about `count` surfels.
double spacingFor(const TriangleMesh& mesh, size_t count);

// Computes radius and coverage, as sampleSurfels does, for a cloud with positions and frames. No radius
// exceeds twice the median.
void estimateSplats(SurfelCloud& cloud, const Progress& progress = {});

} // namespace surflect
