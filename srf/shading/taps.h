// Taps: the texels of a reflectance image that a look-up interpolates, and the blocks that hold them.
#pragma once

#include "srf/codec/view_file.h"
#include "srf/shading/block_lookup.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace surflect::shading {

// A position between texel centres: the upper left texel, and the fractions of the way to the next ones.
struct TexelPosition {
  int x, y;          // not negative
  float right, down; // 0..1; 0 if the next texel is outside the image

  // Converts finite (x, y) in pixels, with pixel centres at +0.5. Clamps to the image.
  static TexelPosition at(const codec::ViewHeader& view, float x, float y) {
    assert(std::isfinite(x) && std::isfinite(y));
    const float u = std::min(std::max(x - 0.5f, 0.f), static_cast<float>(view.width - 1));
    const float v = std::min(std::max(y - 0.5f, 0.f), static_cast<float>(view.height - 1));
    const int i = static_cast<int>(u), j = static_cast<int>(v);
    return {i, j, u - static_cast<float>(i), v - static_cast<float>(j)};
  }

  // Returns true if all four texels lie in one block.
  bool isInOneBlock() const { return (x + 1) % codec::blockSize != 0 && (y + 1) % codec::blockSize != 0; }
  codec::BlockPosition block() const {
    return {static_cast<int>(unsigned(x) / codec::blockSize),
            static_cast<int>(unsigned(y) / codec::blockSize)};
  }

  // The four taps, if they lie in one block.
  BlockTaps tapsInOneBlock() const {
    const float left = 1 - right, up = 1 - down;
    return {{left * up, right * up, left * down, right * down},
            static_cast<uint8_t>(unsigned(y) % codec::blockSize * codec::blockSize +
                                 unsigned(x) % codec::blockSize),
            1,
            codec::blockSize};
  }

  // The taps in a block that holds at least one of the four texels; taps outside the block have weight 0.
  BlockTaps tapsIn(codec::BlockPosition block) const {
    const PairInBlock across(x - block.x * codec::blockSize, right),
        along(y - block.y * codec::blockSize, down);
    return {{across.firstWeight * along.firstWeight, across.secondWeight * along.firstWeight,
             across.firstWeight * along.secondWeight, across.secondWeight * along.secondWeight},
            static_cast<uint8_t>(along.first * codec::blockSize + across.first),
            static_cast<uint8_t>(across.step),
            static_cast<uint8_t>(along.step * codec::blockSize)};
  }

private:
  // Two neighbouring texels of a row or column, with their weights; a texel outside the block has weight 0.
  struct PairInBlock {
    PairInBlock(int place, float toNext)
        : first(std::max(place, 0)), step(place >= 0 && place + 1 < codec::blockSize ? 1 : 0),
          firstWeight(place >= 0 ? 1 - toNext : 0), secondWeight(place + 1 < codec::blockSize ? toNext : 0) {}
    int first, step; // step: offset of the second texel, 0 if outside the block
    float firstWeight, secondWeight;
  };
};

// Calls use(position) for each block that holds a texel of nonzero weight: left before right, upper before
// lower. If all four texels lie in one block, it is visited even if some of them are outside the image, since
// blocks are whole.
template <class Use> inline void forEachBlock(const TexelPosition& place, const Use& use) {
  const codec::BlockPosition first = place.block();
  if (place.isInOneBlock()) return use(first);
  const int acrossEnd =
      place.right > 0 ? (place.x + 1) / codec::blockSize : first.x; // stays within the image
  const int downEnd = place.down > 0 ? (place.y + 1) / codec::blockSize : first.y;
  for (int y = first.y; y <= downEnd; ++y)
    for (int x = first.x; x <= acrossEnd; ++x) use(codec::BlockPosition{x, y});
}

// The taps of a bilinear interpolation that fall into one stored block.
template <class Block> struct PlacedTaps {
  Block block;
  BlockTaps taps;
};

// The taps of a position, grouped by block in the order of forEachBlock.
template <class Block> class ViewTaps {
public:
  size_t size() const { return count_; }
  bool empty() const { return count_ == 0; }
  const PlacedTaps<Block>* begin() const { return blocks_.data(); }
  const PlacedTaps<Block>* end() const { return blocks_.data() + count_; }

  void clear() { count_ = 0; }
  const BlockTaps& add(const Block& block, const BlockTaps& taps) {
    blocks_[count_] = {block, taps};
    return blocks_[count_++].taps;
  }
  void divideWeights(float sum) {
    for (PlacedTaps<Block>& placed : std::span(blocks_).first(count_))
      for (float& weight : placed.taps.weights) weight /= sum;
  }

private:
  // Entries beyond count_ are uninitialised, as thousands of objects are made at a time.
  std::array<PlacedTaps<Block>, 4> blocks_;
  size_t count_ = 0;
};

// Finds the taps of a place. find(position) returns the block there, or false for background. Taps on
// background are dropped and the others renormalised; empty if none is left. Blocks are visited in the order
// of forEachBlock.
template <class Block, class Find>
void findTaps(const TexelPosition& place, const Find& find, ViewTaps<Block>& taps) {
  taps.clear();
  float kept = 0;
  bool isWhole = true;
  forEachBlock(place, [&](codec::BlockPosition position) {
    const Block block = find(position);
    if (!block) {
      isWhole = false;
      return;
    }
    for (const float weight : taps.add(block, place.tapsIn(position)).weights) kept += weight;
  });
  if (!isWhole && !taps.empty()) taps.divideWeights(kept);
}

inline BlockLookup jobOf(const codec::BlockTerms& block, const BlockTaps& taps, float* rgb) {
  const auto texel = 3 * static_cast<uint32_t>(block.stride);
  return {block.texel(taps.texel),
          block.coefficients,
          rgb,
          static_cast<uint32_t>(block.stride),
          taps.right * texel,
          taps.down * texel,
          {taps.weights[0], taps.weights[1], taps.weights[2], taps.weights[3]}};
}

// A point within the texel centres of a stored block.
struct StoredPoint {
  float x = 0, y = 0; // pixels
};

// Whether a look-up at finite (x, y) finds a texel in a stored block.
inline bool storesTexel(const codec::ViewFile& view, float x, float y) {
  bool isStored = false;
  forEachBlock(TexelPosition::at(view.header(), x, y),
               [&](codec::BlockPosition block) { isStored |= view.find(block).has_value(); });
  return isStored;
}

// The stored point nearest to (x, y); empty if the view stores nothing. Among equally near points, returns
// the first one found when searching rings of blocks around the block of (x, y).
std::optional<StoredPoint> nearestStored(const codec::ViewFile& view, float x, float y);

} // namespace surflect::shading
