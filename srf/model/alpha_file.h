// views/NNNN.srfa of a model: the alpha plane of one view. Specified in docs/format.md.
#pragma once

#include "srf/codec/alpha_plane.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::model {

std::vector<std::byte> packAlpha(const codec::AlphaPlane& plane);

// Reads the content of a file. Throws Error naming the field, also unless the plane is width x height.
codec::AlphaPlane unpackAlpha(std::span<const std::byte> content, int width, int height);

} // namespace surflect::model
