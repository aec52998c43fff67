// Nearest codewords of vectors, exactly.
#pragma once

#include "render/lightfield/lfm/vector_quantization.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::lfm {

// |a - b|^2
double squaredDistance(std::span<const float> a, std::span<const float> b);

struct Assignment {
  std::vector<uint32_t> indices; // nearest codeword of each vector
  std::vector<double> squares;   // squared distance to it
};

// Nearest codeword of each vector; of several, the first, unless `before` names one of them. `before` may be
// empty. Distances to all codewords are a product of matrices; those that are nearest within its rounding
// error are computed again in double precision.
Assignment nearestCodewords(const VectorSet& vectors, std::span<const float> codewords,
                            std::span<const uint32_t> before);

} // namespace surflect::lfm
