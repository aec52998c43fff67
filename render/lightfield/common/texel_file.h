// Texels in files of light fields: half floats r, g, b and a fourth channel, one texel after another. All are
// finite.
#pragma once

#include "surfel/base/open_file.h"
#include "surfel/base/progress.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace surflect::lightfield {

using Texel = std::array<uint16_t, 4>; // bits of half floats

inline bool isFinite(const Texel& texel) {
  constexpr uint16_t kExponent = 0x7c00;
  for (const uint16_t half : texel)
    if ((half & kExponent) == kExponent) return false;
  return true;
}

// Throws Error naming the file unless it holds this number of texels.
void requireTexels(const OpenFile& file, uint64_t texels);

// Reads the texels from a place on, counted in texels. Throws Error naming the file, also for a texel that is
// not finite; and Cancelled.
void readTexels(const OpenFile& file, uint64_t first, std::span<Texel> texels, const Progress& progress = {});

} // namespace surflect::lightfield
