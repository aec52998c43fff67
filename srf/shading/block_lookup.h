// Look-ups of light-blended radiance in PCA blocks, vectorised.
#pragma once

#include "srf/weights/light_table.h"

#include <cstddef>
#include <cstdint>

namespace surflect::shading {

// Bilinear taps that fall into one block: upper left, upper right, lower left and lower right texel. Unused
// taps have weight 0.
struct BlockTaps {
  float weights[4];
  uint8_t texel;       // index of the upper left texel
  uint8_t right, down; // offset of the next texel in each direction; 0 if that texel is not in the block
};

// Look-up at one position in one block.
struct BlockLookup {
  const int8_t* levels; // as in Block, at the upper left texel
  const float* coefficients;
  float* rgb;           // sum to add to: three channels and an unused number
  uint32_t stride;      // a multiple of 8
  uint32_t right, down; // levels from one texel to the next
  float weights[4];     // tap weights
};

// Adds to each job's rgb, over the lights i of a row with weights w_il,
//   sum_k (sum_i color_i sum_l w_il a_lk) (sum over taps of tap * e_k).
// Jobs that share a row are computed together, so that each weight is loaded once for several; in a long run
// of jobs, those in one block also share the sums over lights. The result of a job does not depend on other
// jobs; jobs that add to the same numbers do so in order. All instruction sets give the same bits, except
// scalar code, which rounds each product.
void lookUp(const weights::BlendedLight* row, size_t lights, const weights::LightWeight* weights,
            const BlockLookup* jobs, size_t count);

} // namespace surflect::shading
