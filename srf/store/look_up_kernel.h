// Look-ups in blocks, compiled for each kind of vector instructions. Raw pointers only: see surfel/simd.h.
#pragma once

#include "srf/store/light_weight.h"

#include <cstddef>
#include <cstdint>

namespace surflect {

// The taps of a bilinear interpolation that fall into a block; what is not needed has weight 0.
struct BlockTaps {
  float weights[4];
  uint8_t texels[4];
};

// One place in one block.
struct LookUpJob {
  const int8_t* levels; // as Block has them
  const float* coefficients;
  size_t stride; // a multiple of 4
  const BlockTaps* taps;
};

// For each job three numbers, one a channel:
//   rgb = sum_k (sum_l w_l a_lk) (sum over taps of tap * e_k).
// Jobs that share a row of light weights are answered together: each weight is loaded once for several. What
// a job gets does not depend on the others; all kinds but scalar, which rounds each product, give the same
// bits.
using LookUpKernel = void (*)(const LightWeight* row, size_t lights, const LookUpJob* jobs, size_t count,
                              float* rgb);

enum class Simd;
LookUpKernel lookUpKernel(Simd simd);

} // namespace surflect
