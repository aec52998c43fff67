// Principal components of an arranged matrix.
//
// [Halko 2011] Halko, Martinsson, Tropp: Finding Structure with Randomness.
#pragma once

#include "render/lightfield/lfm/arranged_matrix.h"
#include "surfel/math/padded_rows.h"

#include <cstddef>
#include <vector>

namespace surflect::lfm {

// Mean of each row in each plane, and the `terms` leading terms of the singular value decomposition of the
// rest; fewer if what is left is rounding error. Columns of V have unit length. All entries count equally:
// weights are ignored.
PlainFactors principalComponents(ArrangedMatrix matrix, size_t terms);

// Leading terms of the singular value decomposition of a matrix, without a mean: U has the lengths. There are
// fewer if these leave at most `negligible` of the sum of squares.
PlainFactors leadingTerms(const PaddedRows<float>& values, size_t terms, double negligible);

// Sum of weighted squares that is rounding error once the mean of the matrix is taken out.
double roundingOf(const ArrangedMatrix& matrix);

// Weighted mean of each row in each plane [rows][planes], which is subtracted from the observed values.
std::vector<float> takeMean(ArrangedMatrix& matrix);

} // namespace surflect::lfm
