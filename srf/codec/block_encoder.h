// From the radiances of one block to its record.
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
  double clippedSquaredError = 0; // the same with X and X' clipped to [0, white]
};

// `present`: bit 8 y + x is set where texel (x, y) shows the object; not zero. `radiance`: row 3 i + c is
// channel c of the i-th present texel in order of bits, one column a light; finite and below 1e30.
// `white` > 0 is the radiance of a white pixel. Guarantees blockErrorBound, and channelMeanBound
// where 16 bits reach it. All kinds of vector instructions give the same record.
EncodedBlock encodeBlock(uint64_t present, const Eigen::MatrixXf& radiance, double tolerance, double white);

} // namespace surflect::codec
