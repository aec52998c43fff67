// levels.bin of a model: levels of detail of its cloud. Specified in docs/format.md.
#pragma once

#include "surfel/base/progress.h"
#include "surfel/level_of_detail.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::model {

std::vector<std::byte> packLevels(const LevelsOfDetail& levels);

// Reads the levels of a cloud, whose splats are those of level 0. Throws Error naming the field, and
// Cancelled.
LevelsOfDetail unpackLevels(std::span<const std::byte> packed, const SurfelCloud& cloud,
                            const Progress& progress = {});

} // namespace surflect::model
