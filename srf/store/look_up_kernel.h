// A look-up in one block, compiled for each kind of vector instructions; all give the same bits. Raw pointers
// only: see surfel/simd.h.
#pragma once

#include "srf/store/light_weight.h"

#include <cstddef>
#include <cstdint>

namespace surflect {

// The taps of a bilinear interpolation that fall into a block.
struct BlockTaps {
  float weights[4];
  uint8_t texels[4];
  uint32_t count;
};

struct LookUpJob {
  const int8_t* levels; // as Block has them
  const float* coefficients;
  size_t stride; // a multiple of 4
  const LightWeight* row;
  size_t lights; // of the row
};

// rgb = sum_k (sum_l w_l a_lk) (sum over taps of tap * e_k), per channel.
using LookUpKernel = void (*)(const LookUpJob&, const BlockTaps&, float* rgb);

enum class Simd;
LookUpKernel lookUpKernel(Simd simd);

} // namespace surflect
