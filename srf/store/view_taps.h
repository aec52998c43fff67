// Where in a view's file the answer to a look-up lies.
#pragma once

#include "srf/store/look_up_kernel.h"
#include "srf/store/view_file.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

namespace surflect {

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

// (x, y) in pixels, centres at +0.5, finite; clamped to the image. Taps on background are dropped and the
// others renormalised; empty if none is left.
ViewTaps tapsAt(const ViewFile& view, float x, float y);

// A point between texel centres of a stored block.
struct StoredPoint {
  float x = 0, y = 0; // pixels
};

// The one that is nearest to (x, y); empty for a view that stores nothing. Of equals, the first in rings of
// blocks about the one that holds (x, y).
std::optional<StoredPoint> nearestStored(const ViewFile& view, float x, float y);

} // namespace surflect
