// Alpha of one view, for look-ups: 8 bits per pixel in blocks of 8x8 pixels, without texels where a block is
// clear or opaque throughout. Alpha does not depend on the light.
#pragma once

#include "srf/image/image.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::codec {

class AlphaPlane {
public:
  AlphaPlane() = default;
  // Rounds alpha, one channel, to multiples of 1/255; values outside of 0..1 are clamped.
  explicit AlphaPlane(const image::Image& alpha);
  // levels: width x height, row by row; 255 is opaque.
  AlphaPlane(int width, int height, std::span<const uint8_t> levels);

  int width() const { return width_; }
  int height() const { return height_; }
  // All levels, row by row.
  std::vector<uint8_t> levels() const;

  // Alpha at (x, y) in pixels, centres at +0.5: bilinear, and constant from the outermost centres on, as
  // look-ups of colour are. Both must be finite.
  float at(float x, float y) const;

  size_t memoryBytes() const { return starts_.size() * sizeof(uint32_t) + texels_.size(); }

private:
  uint8_t level(int x, int y) const;

  int width_ = 0, height_ = 0, across_ = 0; // across_: blocks in a row
  std::vector<uint32_t> starts_;            // of each block in texels_, or kClear or kOpaque
  std::vector<uint8_t> texels_;
};

} // namespace surflect::codec
