// Look-ups in blocks, in vector instructions.
#pragma once

#include "surfel/math/rgb.h"

#include <cstddef>
#include <cstdint>

namespace surflect::shading {

// A captured light, by its column, and its weight.
struct LightWeight {
  uint32_t light;
  float weight;
};

// Light of one colour, and the captured lights that are blended for it: a range of weights.
struct BlendedLight {
  Rgb color;
  uint32_t begin = 0, end = 0;
};

// The taps of a bilinear interpolation that fall into a block: of the upper left texel, the one right of it,
// the one below, and the one below right. Unused taps have weight 0.
struct BlockTaps {
  float weights[4];
  uint8_t texel;       // the upper left
  uint8_t right, down; // texels from it to the next, 0 where that is not in the block
};

// A look-up at one place in one block.
struct LookUpJob {
  const int8_t* levels; // as Block has them, of the upper left texel
  const float* coefficients;
  float* rgb;           // sum to add to: three channels, and a number without meaning
  uint32_t stride;      // a multiple of 8
  uint32_t right, down; // levels from a texel to the next
  float weights[4];     // of the taps
};

// Adds to each job's numbers
//   sum_k (sum_i color_i sum_l w_il a_lk) (sum over taps of tap * e_k)
// over the lights i of a row, whose weights are w_il. Jobs that share a row are answered together: each
// weight is loaded once for several. What a job gets does not depend on the others, and those that add to the
// same numbers do so in their order; all kinds but scalar, which rounds each product, give the same bits.
void lookUp(const BlendedLight* row, size_t lights, const LightWeight* weights, const LookUpJob* jobs,
            size_t count);

} // namespace surflect::shading
