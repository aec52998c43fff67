// Principal components of a matrix of which not all entries were observed, or not equally well.
#pragma once

#include "render/lightfield/lfm/arranged_matrix.h"
#include "surfel/base/progress.h"

#include <cstddef>

namespace surflect::lfm {

struct FitOptions {
  size_t terms = 1;
  size_t mostIterations = 1;
  double convergence = 0; // iteration ends once the RMS error falls by less than this share in one
};

// Mean and `terms` terms with a small weighted squared error, by alternating least squares from the principal
// components; they are orthogonal in the end, the strongest first. There are none if the matrix is its mean.
// The mean is that of the fitted product over all cells, each counted once. The matrix must have weights.
//
// A ridge keeps factors of rows and cells with few observations near 0: that of a normal prior with the mean
// square that a factor has so far, weighted by kPriorShare. Factors are finite if the values are.
PlainFactors weightedComponents(ArrangedMatrix matrix, const FitOptions& options, const Progress& progress);

inline constexpr double kPriorShare = 0.1;

} // namespace surflect::lfm
