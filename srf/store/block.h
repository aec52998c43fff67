// One block of a view: 8x8 pixels under all of the view's lights, factored as  X ~ E A.
//
// X has a row for each object texel and colour channel, and a column for each light; E holds K eigenimages,
// A their coefficients, which the three channels share. The mean is not taken off: it would be one more
// eigenimage. [Weyrich 2005, §5.3] stores such "PCA data"; what follows is ours: each eigenimage has its own
// precision, and rank and precisions are the cheapest that keep the block's error bounds.
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

// The bound counts a block darker than this part of white as if it were that bright.
inline constexpr double blockErrorFloor = 1e-3;
// What 16 bits at full rank reach whatever the block: half a quantiser step in each of up to 192 rows is
// sqrt(192) / (2 * 32767) = 2.1e-4 of |X|. Smaller tolerances are taken as this one.
inline constexpr double smallestTolerance = 2.5e-4;

// tau max(|X|_F, 1e-3 white sqrt(n)), n the number of values in X.
double blockErrorBound(double norm, size_t values, double tolerance, double white);

// Of the errors under a light which shows the block at this brightness, root mean square: (rms / white +
// 0.01)^ -1/2. A light that shows it dimly has its say, for the script may make it bright; as one that stands
// beside a highlight it would have none.
double lightWeight(double rms, double white);

struct EncodedBlock {
  std::vector<std::byte> record;
  int rank = 0;
  double squaredError = 0;        // |X - X'|_F^2 of the stored numbers
  double clippedSquaredError = 0; // the same with X and X' clipped to [0, white]
};

// `present`: bit 8 y + x is set where texel (x, y) shows the object; not zero. `radiance`: row 3 i + c is
// channel c of the i-th present texel in order of bits, one column a light; finite and below 1e30.
// `white` > 0 is the radiance of a white pixel. Guarantees |X - X'|_F <= blockErrorBound, and the same of X W
// and X' W, W the lights' weights.
EncodedBlock encodeBlock(uint64_t present, const Eigen::MatrixXf& radiance, double tolerance, double white);

// A block ready for look-ups. Absent texels are filled from the nearest present one, so that bilinear
// interpolation inside the block never mixes background in.
struct Block {
  int rank = 0;                    // K
  int stride = 0;                  // K rounded up to a multiple of 4; what lies between is zero
  uint64_t present = 0;            // as given to encodeBlock
  std::vector<float> basis;        // [64 texels][3 channels][stride], each in [-1, 1]
  std::vector<float> coefficients; // [lights][stride]

  const float* texel(int t) const { return basis.data() + static_cast<size_t>(t) * 3 * stride; }
  const float* light(size_t l) const { return coefficients.data() + l * stride; }
  size_t memory() const {
    return sizeof(Block) + (basis.capacity() + coefficients.capacity()) * sizeof(float);
  }
};

// Throws Error where the record is not one of a block under so many lights.
Block decodeBlock(std::span<const std::byte> record, size_t lights);

} // namespace surflect
