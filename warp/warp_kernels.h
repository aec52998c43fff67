// Warps of many points at once, and what is before and after them, compiled for each kind of vector
// instructions. Raw pointers only: see surfel/math/simd.h. avx2 and avx512 give the same bits; scalar rounds
// a b + c twice. What becomes of a point does not depend on its neighbours.
#pragma once

#include "warp/warp_batch.h"

#include <cstdint>

namespace surflect {
enum class Simd;
}

namespace surflect::warp {

constexpr int kWarpGroup = 8; // points in lanes

// The displacement within a lattice's box as a polynomial in (s, t, u), which here is the place less the
// box's middle.
struct LatticeStep {
  const double *middle, *half; // of the box, 3 each: where it is, and how far it goes to each side
  const int* divisions;        // the polynomial's degrees, 3
  const double* coefficients;  // 3 each; those of the highest powers first, of s running fastest, then t
};

// All in double precision. Steps take each point x to Psi(x), its tangents d to J d, and its determinant to
// det J times it. Their parameters are those in warp.cpp; vectors are 3 doubles.
struct WarpKernels {
  // The batch, of `count` points, from places p0 and tangent frames r0 (frame.h), 3 floats each. The
  // determinant is 1.
  void (*begin)(const float* p0, const float* r0, int count, WarpBatch&);

  // `linear` by columns; its determinant is given.
  void (*affine)(const double* linear, const double* offset, double determinant, WarpBatch&);
  void (*twist)(const double* axis, double k, const double* center, WarpBatch&);
  // k is not 0.
  void (*bend)(const double* axis, const double* direction, double k, const double* center, WarpBatch&);
  void (*taper)(const double* axis, double g, const double* center, WarpBatch&);
  void (*sine)(const double* axis, const double* direction, const double* center, double amplitude, double q,
               double phase, WarpBatch&);
  void (*lattice)(const LatticeStep&, WarpBatch&);

  // p, u, v rounded, 3 floats a point, and the sign of the determinant; up to the next whole
  // group, with any numbers beyond count. `doubtful` gets a bit for each point of which it is not sure that
  // all is finite and that u and v have a polarFrame: 32 points a number, from the lowest bit on.
  void (*finish)(const WarpBatch&, float* p, float* u, float* v, int8_t* handedness, uint32_t* doubtful);
};

const WarpKernels& warpKernels(Simd simd);

} // namespace surflect::warp
