// Surfels from a mesh, evenly spaced.
#pragma once

#include "surfel/base/progress.h"
#include "surfel/cloud.h"
#include "surfel/geometry/mesh.h"

#include <cstdint>

namespace surflect {

// The ratio of a splat's Gaussian sigma to its radius.
inline constexpr float kSigmaPerRadius = 0.6f;

// Surfels that lie about `spacing` apart (scene units) as in a hexagonal grid: a Poisson-disk set evened out
// by Lloyd's relaxation. Sheets are told apart by their normals, so that both sides of a thin wall and of a
// sharp edge are covered. radius is the mean distance to the six nearest neighbours; coverage makes the
// Gaussians sum to 1 at every surfel, and at borders to what of the surfel's own lies within them: their sum
// falls to 1/2 at the border, so that outlines stay where they are. Sorted along a space-filling curve. Cost:
// O(area / spacing^2).
SurfelCloud sampleSurfels(const TriangleMesh& mesh, double spacing, uint64_t seed = 1,
                          const Progress& progress = {});

// The number of surfels that sampleSurfels yields, about.
double surfelsAt(const TriangleMesh& mesh, double spacing);

// The spacing at which sampleSurfels yields about `count` surfels.
double spacingFor(const TriangleMesh& mesh, size_t count);

// Radius and coverage, as above, of a cloud that has positions and frames. No radius is more than twice the
// median.
void estimateSplats(SurfelCloud& cloud, const Progress& progress = {});

double surfaceArea(const TriangleMesh& mesh);

} // namespace surflect
