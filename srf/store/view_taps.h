// Where in a view's file the answer to a look-up lies.
#pragma once

#include "srf/store/look_up_kernel.h"
#include "srf/store/view_file.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace surflect {

// A position among texels: the one up and left of it, and how far it is from this to the next.
struct TexelPlace {
  int x, y;
  float right, down; // 0..1; 0 where the next is outside the image

  // (x, y) in pixels, centres at +0.5, finite; clamped to the image.
  static TexelPlace at(const ViewHeader& view, float x, float y) {
    assert(std::isfinite(x) && std::isfinite(y));
    const float u = std::clamp(x - 0.5f, 0.f, static_cast<float>(view.width - 1));
    const float v = std::clamp(y - 0.5f, 0.f, static_cast<float>(view.height - 1));
    const int i = static_cast<int>(u), j = static_cast<int>(v);
    return {i, j, u - static_cast<float>(i), v - static_cast<float>(j)};
  }

  // Of a corner: left before right, the upper row first.
  float weight(int corner) const {
    return (corner & 1 ? right : 1 - right) * (corner >> 1 ? down : 1 - down);
  }

  // Are all four corners in the block that holds the first?
  bool isInOneBlock() const { return (x + 1) % blockSize != 0 && (y + 1) % blockSize != 0; }
  BlockPosition block() const { return {x / blockSize, y / blockSize}; }
  // Where they are.
  BlockTaps taps() const {
    const int first = y % blockSize * blockSize + x % blockSize;
    const auto texel = [&](int step) { return static_cast<uint8_t>(first + step); };
    return {{weight(0), weight(1), weight(2), weight(3)},
            {texel(0), texel(1), texel(blockSize), texel(blockSize + 1)}};
  }
};

// The part of a bilinear interpolation that one stored block answers.
struct PlacedTaps {
  uint32_t block; // its number in the view's file
  BlockTaps taps;
};

// Of a position, by block, in the order in which its corners (left before right, the upper row first) ask.
class ViewTaps {
public:
  size_t size() const { return count_; }
  bool empty() const { return count_ == 0; }
  const PlacedTaps& operator[](size_t i) const { return blocks_[i]; }
  const PlacedTaps* begin() const { return blocks_.data(); }
  const PlacedTaps* end() const { return blocks_.data() + count_; }

  // The weight of a corner, to the taps in this block, or as the first of another.
  void add(uint32_t block, int corner, int texel, float weight);
  void addBlock(const PlacedTaps& taps) { blocks_[count_++] = taps; }
  void divideWeights(float sum);

private:
  std::array<PlacedTaps, 4> blocks_; // not set before they are counted: thousands are made at a time
  size_t count_ = 0;
};

// Taps on background are dropped and the others renormalised; empty if none is left.
ViewTaps tapsAt(const ViewFile& view, const TexelPlace& place);

// A point between texel centres of a stored block.
struct StoredPoint {
  float x = 0, y = 0; // pixels
};

// The one that is nearest to (x, y); empty for a view that stores nothing. Of equals, the first in rings of
// blocks about the one that holds (x, y).
std::optional<StoredPoint> nearestStored(const ViewFile& view, float x, float y);

} // namespace surflect
