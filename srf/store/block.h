// One block of a view: 8x8 pixels under all of the view's lights, factored as  X ~ E A.
//
// X has a row for each object texel and colour channel, and a column for each light; E holds K eigenimages,
// A their coefficients, which the three channels share. The mean is not taken off: it would be one more
// eigenimage. [Weyrich 2005, §5.3] stores such "PCA data"; what follows is ours: each term, an
// eigenimage with its coefficients, has its own precision, and rank and precisions are the cheapest that keep
// the block's error bound.
//
// The record of a block is specified to the byte in docs/format.md.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect {

inline constexpr int blockSize = 8; // pixels a side
inline constexpr int blockTexels = blockSize * blockSize;

// One over the error that may be, in parts of the tolerance, where a block is this bright, root mean square:
// (r^2 + r + 0.01)^-1/2 with r = rms / white. That is the shape of a camera's own noise: below white it
// grows with the root of the light, as what a display with a gamma of 2 shows alike, beyond white with the
// light itself, and in the dark it stays.
double errorWeight(double rms, double white);

// Errors of a block are weighed per light, by how bright the light shows the block, and per channel, by how
// much darker than all three the channel is: a light that shows the block dimly has its say beside a
// highlight, and red has in blue paint, for the script may make them bright.
struct BlockWeights {
  Eigen::Vector3d channels; // root mean square over lights of the channel's errorWeight over the light's
  Eigen::VectorXd lights;   // errorWeight of all channels
};

// Rows and columns as encodeBlock has them.
BlockWeights blockWeights(const Eigen::MatrixXd& radiance, double white);

// Of |V (X - X') W|_F, with V and W the weights of channels and lights: tau |V X W|_F, where a block darker
// than 0.001 white counts as that bright; but not below what 16 bits at full rank reach whatever the block,
// 2.5e-4 max(V) |X W|_F. Rows and columns as encodeBlock has them.
double blockErrorBound(const Eigen::MatrixXd& radiance, const BlockWeights& weights, double tolerance,
                       double white);

struct EncodedBlock {
  std::vector<std::byte> record;
  int rank = 0;
  double squaredError = 0;        // |X - X'|_F^2 of the stored numbers
  double clippedSquaredError = 0; // the same with X and X' clipped to [0, white]
};

// `present`: bit 8 y + x is set where texel (x, y) shows the object; not zero. `radiance`: row 3 i + c is
// channel c of the i-th present texel in order of bits, one column a light; finite and below 1e30.
// `white` > 0 is the radiance of a white pixel. Guarantees blockErrorBound.
EncodedBlock encodeBlock(uint64_t present, const Eigen::MatrixXf& radiance, double tolerance, double white);

// What a look-up needs of a block, wherever it is kept: eigenimages as levels of 8 bits, and coefficients
// times what a level stands for, so that X' is their product. Terms at 16 bits are two here, of high and of
// low levels.
struct BlockTerms {
  int rank = 0;                        // K, of terms as they are stored
  int stride = 0;                      // terms here, rounded up to a multiple of 4; what is too many is zero
  const float* coefficients = nullptr; // [lights][stride]
  const int8_t* levels = nullptr;      // [64 texels][3 channels][stride]

  const float* light(size_t l) const { return coefficients + l * stride; }
  const int8_t* texel(int t) const { return levels + static_cast<size_t>(t) * 3 * stride; }
};

// Of the values of a Block.
inline BlockTerms blockTerms(int rank, int stride, size_t lights, const std::byte* values) {
  const auto* coefficients = reinterpret_cast<const float*>(values);
  return {rank, stride, coefficients, reinterpret_cast<const int8_t*>(coefficients + lights * stride)};
}

// A block ready for look-ups. Absent texels are filled from the nearest present one, so that bilinear
// interpolation inside the block never mixes background in.
struct Block {
  int rank = 0, stride = 0; // as BlockTerms has them
  uint64_t present = 0;     // as given to encodeBlock
  size_t lights = 0;
  std::vector<std::byte> values; // coefficients, then levels, as BlockTerms has them

  BlockTerms terms() const { return blockTerms(rank, stride, lights, values.data()); }
  const float* light(size_t l) const { return terms().light(l); }
  const int8_t* texel(int t) const { return terms().texel(t); }
  size_t memory() const { return sizeof(Block) + values.capacity(); }
};

// Throws Error where the record is not one of a block under so many lights.
Block decodeBlock(std::span<const std::byte> record, size_t lights);

} // namespace surflect
