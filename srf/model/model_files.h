// Files of a model's folder: alpha, levels of detail, tables, visibility.
#pragma once

#include "srf/codec/alpha_plane.h"
#include "srf/reflectance/shared_reflectance.h"
#include "srf/weights/visibility_weights.h"
#include "surfel/base/time.h"
#include "surfel/level_of_detail.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::model {

// views/NNNN.srfa of a model: the alpha plane of one view. Specified in docs/format.md.
std::vector<std::byte> packAlpha(const codec::AlphaPlane& plane);

// Reads the content of a file. Throws Error naming the field, also unless the plane is width x height.
codec::AlphaPlane unpackAlpha(std::span<const std::byte> content, int width, int height);

// levels.bin of a model: levels of detail of its cloud. Specified in docs/format.md.
std::vector<std::byte> packLevels(const LevelsOfDetail& levels);

// Reads the levels of a cloud, whose splats are those of level 0. Throws Error naming the field, and
// Cancelled.
LevelsOfDetail unpackLevels(std::span<const std::byte> packed, const SurfelCloud& cloud,
                            const Progress& progress = {});

// tables.bin of a model: shared reflectance of its surfels, with fibres within 1e-4 radians, weights within
// 1/255 and gains as half floats. Specified in docs/format.md.
std::vector<std::byte> packTables(const reflectance::SharedReflectance& shared);

// Reads the tables of a cloud of `surfels`. Throws Error naming the field.
reflectance::SharedReflectance unpackTables(std::span<const std::byte> packed, size_t surfels);

// fades.bin of a model: a zlib stream of visibility weights, view by view. Specified in docs/format.md.

// Compresses the weights. Throws Cancelled.
std::vector<std::byte> packVisibility(const weights::VisibilityWeights& visibility,
                                      const Progress& progress = {});

// Decompresses the weights. Throws Error unless there are exactly surfels x views, and Cancelled.
weights::VisibilityWeights unpackVisibility(std::span<const std::byte> packed, size_t surfels, size_t views,
                                            const Progress& progress = {});

} // namespace surflect::model
