// Largest pictures that are read. Files that claim more are refused before memory is taken for them.
#pragma once

#include <cstdint>

namespace surflect::image {

inline constexpr int kMostSide = 1 << 16; // pixels
inline constexpr int64_t kMostPixels = int64_t{1} << 28;

} // namespace surflect::image
