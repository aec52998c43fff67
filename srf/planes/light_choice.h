// Choices of a few lights.
#pragma once

#include "surfel/math/space.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::planes {

// Indices of at most `most` unit directions that lie far apart, in rising order: the one farthest from the
// mean first, then always the one whose nearest chosen direction is farthest.  [Gonzalez 1985: Clustering to
// minimize the maximum intercluster distance] Neither rings nor arcs nor rows of lamps align with it.
std::vector<size_t> farApart(std::span<const Vec3<double>> towardsLights, size_t most);

// Indices below `count` in rising order: all of them, or `most` of them by multiples of the golden section,
// which no period in the order of lamps, such as five an arc, aligns with.
std::vector<size_t> withoutPeriod(size_t count, size_t most);

} // namespace surflect::planes
