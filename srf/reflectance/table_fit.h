// Fit of a reflectance table to photographs: smoothed least squares.
//
//   minimise over T   sum_i w_i (a_i T(x_i) - y_i)^2  +  (lambda_p D_p^2 + lambda_e D_e^2 + mu T^2) / white^2
//
// Symbols, channel by channel: y_i reflectance in photograph i, a_i factor of its tabulated value (link and
// gain), w_i weight, x_i place in the grid; D_p^2, D_e^2 sums of squared second differences between
// neighbouring nodes along the coordinates of p and of e, as for a thin plate [Duchon 1977]; T^2 sum of
// squared nodes: it decides where nothing else does.
//
// The normal equations are solved by conjugate gradients with the diagonal as preconditioner [Hestenes 1952];
// their matrix is never formed. Photographs are summed in a fixed number of parts, so that the result does
// not depend on the number of threads.
//
// [Duchon 1977] Duchon: Splines minimizing rotation-invariant semi-norms in Sobolev spaces.
// [Hestenes 1952] Hestenes, Stiefel: Methods of Conjugate Gradients for Solving Linear Systems, J. Res.
// NBS 49.
#pragma once

#include "srf/reflectance/reflectance_table.h"
#include "surfel/base/time.h"
#include "surfel/math/rgb.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::reflectance {

// Photographs to fit; all spans have one entry a photograph.
struct FitSamples {
  std::span<const TablePlace> places; // x_i
  std::span<const Rgb> measured;      // y_i
  std::span<const Rgb> factors;       // a_i
  std::span<const float> weights;     // w_i, about 1 / white^2 or less
};

struct FitOptions {
  float white = 1;               // reflectance of a white pixel, > 0
  double smoothHalf = 0.02;      // lambda_p
  double smoothDifference = 0.2; // lambda_e
  double ridge = 1e-4;           // mu
  double tolerance = 1e-4;       // of the residual of the normal equations, relative to their right side
  size_t mostIterations = 60;
};

// Values of all stored nodes (#grid.size()), from those of `start` on, or 0 without any. In single precision.
// Throws Cancelled. Costs about 200 products a photograph and iteration.
std::vector<Rgb> fitTable(const TableGrid& grid, const FitSamples& samples, const FitOptions& options,
                          std::span<const Rgb> start = {}, const Progress& progress = {});

// Reference of fitTable: a dense matrix in double precision, for grids of up to a few thousand nodes.
std::vector<Rgb> fitTableReference(const TableGrid& grid, const FitSamples& samples,
                                   const FitOptions& options);

} // namespace surflect::reflectance
