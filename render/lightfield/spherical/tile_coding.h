// Compression of one image: differences of neighbouring texels, byte by byte, in a zlib stream.
#pragma once

#include "render/lightfield/spherical/pencil_image.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::spherical {

struct Tile {
  std::vector<Texel> colors;
  std::vector<Height> heights;

  friend bool operator==(const Tile&, const Tile&) = default;
};

// Bytes of a tile of size x size texels.
std::vector<std::byte> encoded(const Tile& tile, int size);

// Inverse of encoded(). Throws Error unless the bytes are a tile of this size whose texels are as Texel says.
Tile decoded(std::span<const std::byte> bytes, int size);

} // namespace surflect::spherical
