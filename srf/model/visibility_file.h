// fades.bin of a model: a zlib stream of visibility weights, view by view. Specified in docs/format.md.
#pragma once

#include "srf/weights/visibility_weights.h"
#include "surfel/base/progress.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::model {

// Compresses the weights. Throws Cancelled.
std::vector<std::byte> packVisibility(const weights::VisibilityWeights& visibility,
                                      const Progress& progress = {});

// Decompresses the weights. Throws Error unless there are exactly surfels x views, and Cancelled.
weights::VisibilityWeights unpackVisibility(std::span<const std::byte> packed, size_t surfels, size_t views,
                                            const Progress& progress = {});

} // namespace surflect::model
