// A model as if fewer cameras had seen it, over the same files.
#pragma once

#include "srf/model/model.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::bench {

// So many of the model's views (at most all), spread as evenly as may be about the middle of its surfels:
// each next one is farthest from those before it. [Gonzalez 1985] Those of a smaller count are among those of
// a larger one. Ascending.
std::vector<size_t> evenViews(const model::Model& model, size_t count);

// With these views alone, ascending and at least one.
model::Model withViews(const model::Model& model, std::span<const size_t> views);

} // namespace surflect::bench
