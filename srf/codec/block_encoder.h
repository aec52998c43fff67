// Encodes the radiances of one block as a record.
#pragma once

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::codec {

struct EncodedBlock {
  std::vector<std::byte> record;
  int rank = 0;
  double squaredError = 0;        // |X - X'|_F^2 of the stored numbers
  double clippedSquaredError = 0; // after X and X' are clipped to [0, white]
};

// Encodes one block. Bit 8 y + x of `present` is set if texel (x, y) shows the object; at least one bit is
// set. Row 3 i + c of `radiance` is channel c of the i-th present texel in bit order, with a column for each
// light; values are finite and below 1e30. `white` > 0 is the radiance of a white pixel. The record keeps
// blockErrorBound, and channelMeanBound where 16 bits reach it. Every instruction set gives the same record.
EncodedBlock encodeBlock(uint64_t present, const Eigen::MatrixXf& radiance, double tolerance, double white);

} // namespace surflect::codec
