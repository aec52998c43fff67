// Principal components of an arranged matrix.
#pragma once

#include "render/lightfield/lfm/arranged_matrix.h"
#include "surfel/math/padded_rows.h"

#include <cstddef>
#include <vector>

namespace surflect::lfm {

// Mean of each row in each plane, and the `terms` leading terms of the singular value decomposition of the
// rest, or as few as leave at most `tolerated` of its sum of squares; fewer if what is left is rounding
// error. Columns of V have unit length. All entries count equally: weights are ignored.
PlainFactors principalComponents(ArrangedMatrix matrix, size_t terms, double tolerated);

// Leading terms of the singular value decomposition of a matrix, without a mean: U has the lengths.
PlainFactors leadingTerms(const PaddedRows<float>& values, size_t terms, double tolerated);

// Weighted mean of each row in each plane [rows][kPlanes], which is subtracted from the observed values.
std::vector<float> takeMean(ArrangedMatrix& matrix);

} // namespace surflect::lfm
