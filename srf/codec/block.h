// One block of a view: 8x8 pixels under all of the view's lights, factored as  X ~ E A.
//
// X has a row for each present texel and colour channel, and a column for each light. E holds K eigenimages,
// A their coefficients; the three channels share A. The mean is not subtracted, because storing it would cost
// one more eigenimage.
//
// [Weyrich 2005, §5.3] stores such "PCA data". Beyond the paper, each term (an eigenimage with its
// coefficients) has its own precision; rank and precisions are the cheapest that keep the block's error
// bound.
//
// docs/format.md specifies the record of a block to the byte.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

namespace surflect::codec {

inline constexpr int blockSize = 8; // pixels along a side
inline constexpr int blockTexels = blockSize * blockSize;

// Decoded factors of a block as a look-up reads them. The decoded X' is the product of levels and
// coefficients: eigenimages are levels of 8 bits, and coefficients are multiplied by the step of one level. A
// term of 16 bits appears as two, with the high and the low bytes of its levels.
struct BlockTerms {
  int rank = 0;                        // K, the number of stored terms
  int stride = 0;                      // terms in memory, rounded up to a multiple of 8 with zeros
  const float* coefficients = nullptr; // [lights][stride]
  const int8_t* levels = nullptr;      // [64 texels][3 channels][stride]

  const float* light(size_t l) const { return coefficients + l * stride; }
  const int8_t* texel(int t) const { return levels + static_cast<size_t>(t) * 3 * stride; }
};

// Layout of Block::values: coefficients, then levels. Offsets and sizes are in bytes.
constexpr size_t levelsOffset(int stride, size_t lights) { return lights * stride * sizeof(float); }
constexpr size_t valuesBytes(int stride, size_t lights) {
  return levelsOffset(stride, lights) + size_t{3 * blockTexels} * stride;
}
inline BlockTerms blockTerms(int rank, int stride, size_t lights, const std::byte* values) {
  return {rank, stride, reinterpret_cast<const float*>(values),
          reinterpret_cast<const int8_t*>(values + levelsOffset(stride, lights))};
}

// Uninitialised bytes aligned to cache lines, so that eight coefficients never straddle two lines. An object
// must not be read after it has been moved from.
class CacheAlignedBytes {
public:
  CacheAlignedBytes() = default;
  explicit CacheAlignedBytes(size_t size)
      : size_(size), room_(std::make_unique_for_overwrite<std::byte[]>(size + kLine - 1)) {}

  std::byte* data() {
    std::byte* const begin = room_.get();
    if (!begin) return nullptr;
    return begin + (kLine - reinterpret_cast<uintptr_t>(begin) % kLine) % kLine;
  }
  const std::byte* data() const { return const_cast<CacheAlignedBytes*>(this)->data(); }
  std::span<const std::byte> bytes() const { return {data(), size_}; }
  size_t memory() const { return room_ ? size_ + kLine - 1 : 0; }
  friend bool operator==(const CacheAlignedBytes& a, const CacheAlignedBytes& b) {
    return std::ranges::equal(a.bytes(), b.bytes());
  }

private:
  static constexpr size_t kLine = 64;

  size_t size_ = 0;
  std::unique_ptr<std::byte[]> room_;
};

// A decoded block. Absent texels are copies of the nearest present one, so that bilinear interpolation inside
// the block never mixes in background.
struct Block {
  int rank = 0, stride = 0; // as in BlockTerms
  uint64_t present = 0;     // texel mask, as in encodeBlock
  size_t lights = 0;
  CacheAlignedBytes values; // laid out as levelsOffset and valuesBytes say

  BlockTerms terms() const { return blockTerms(rank, stride, lights, values.data()); }
  const float* light(size_t l) const { return terms().light(l); }
  const int8_t* texel(int t) const { return terms().texel(t); }
  size_t memory() const { return sizeof(Block) + values.memory(); }
};

// Decodes the record of a block. Throws Error if the bytes are not a valid record for `lights` lights.
Block decodeBlock(std::span<const std::byte> record, size_t lights);

// Error bound of a block: brightness-dependent weights and the tolerated weighted error. docs/format.md
// states both.

// Error weight at a root mean square radiance: (r^2 + r + 0.01)^-1/2 with r = rms / white. The inverse of the
// weight, which is the tolerated error, follows a camera's noise: constant in the dark, proportional to the
// square root of radiance below white (which a display of gamma 2 shows evenly), and proportional to radiance
// above white.
double errorWeight(double rms, double white);

// Weights of a block's errors: V = diag(channels) repeated for every texel, W = diag(lights). A light has
// more weight the dimmer the block is under it, and a channel has more weight the darker it is than the mean
// of all three. A script may brighten a dim light, or the red in blue paint, so that their errors must be
// small too.
struct BlockWeights {
  Eigen::Vector3d channels; // root mean square over lights of errorWeight(channel) / errorWeight(light)
  Eigen::VectorXd lights;   // errorWeight of the mean of the three channels
};

// Sums of X^2 over `texels` texels, for each channel and light.
struct ChannelEnergies {
  Eigen::Matrix3Xd sums;
  Eigen::Index texels = 0;
};

BlockWeights blockWeights(const ChannelEnergies& squares, double white);

// |V X W|_F^2, with V and W the weights of channels and lights.
double weightedSquares(const ChannelEnergies& squares, const BlockWeights& weights);

// Bound on |V (X - X') W|_F: tau |V X W|_F, where a block darker than 0.001 white counts as having this
// brightness. Never below 2.5e-4 max(V) |X W|_F, which 16 bits reach at full rank for any block.
double blockErrorBound(const ChannelEnergies& squares, const BlockWeights& weights, double tolerance,
                       double white);

// Bound on the error of a channel's mean over texels and lights: 0.2 % of the mean, or of 0.001 white if the
// mean is smaller. Independent of the tolerance.
double channelMeanBound(double mean, double white);

} // namespace surflect::codec
