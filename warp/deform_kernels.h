// Warps of many points at once, in vector instructions, and the steps before and after them. All instruction
// sets with fused multiply-add give the same bits; others round a b + c twice. The result for a point does
// not depend on its neighbours.
#pragma once

#include "warp/warp.h"

#include <cstdint>

namespace surflect::warp {

constexpr int kWarpGroup = 8; // maximum number of points in lanes

// All computation is in double precision. carryAffine to carryLattice map each point x to Psi(x) and its
// tangents d to J d, and multiply its determinant by det J. Parameters are those in warp.cpp; vectors are 3
// doubles.

// Fills the batch with `count` points, from positions p0 and tangent frames r0 (cloud.h), 3 floats
// each. Determinants are 1.
void beginBatch(const float* p0, const float* r0, int count, WarpBatch&);

// `linear` is stored by columns; `determinant` is its determinant.
void carryAffine(const double* linear, const double* offset, double determinant, WarpBatch&);
void carryTwist(const double* axis, double k, const double* center, WarpBatch&);
// k is not 0.
void carryBend(const double* axis, const double* direction, double k, const double* center, WarpBatch&);
void carryTaper(const double* axis, double g, const double* center, WarpBatch&);
void carrySine(const double* axis, const double* direction, const double* center, double amplitude, double q,
               double phase, WarpBatch&);

// Displacement within a lattice's box, as a polynomial in the position (s, t, u) relative to the middle of
// the box.
struct LatticeStep {
  const double *middle, *half; // of the box, 3 each: its centre, and from there to its sides
  const int* divisions;        // the polynomial's degrees, 3
  const double* coefficients;  // 3 each; highest powers first; that of s varies fastest, then t
};
void carryLattice(const LatticeStep&, WarpBatch&);

// Writes p, u, v rounded to 3 floats per point, and the sign of the determinant. Whole groups are written;
// entries beyond `count` are undefined. `doubtful` gets a bit for each point that may not be finite or may
// have no polarFrame: 32 points per number, from the lowest bit on.
void finishBatch(const WarpBatch&, float* p, float* u, float* v, int8_t* handedness, uint32_t* doubtful);

} // namespace surflect::warp
