// Leading terms of the singular value decomposition of a large dense matrix.
#pragma once

#include "surfel/math/padded_rows.h"
#include "surfel/math/truncated_svd.h"

#include <cstddef>

namespace surflect {

// The `terms` leading terms, or as few as leave at most `tolerated` of |X|_F^2; fewer if the rest is rounding
// error.
//
// Block Lanczos iteration on X' X [Golub and Underwood 1977] with full reorthogonalisation: equal singular
// values are found too. X' X itself is never computed, so that for few terms this is much faster than
// truncatedSvd(). Leading terms do not depend on `terms`, up to kLeadingSvdError.
template <class Real>
TruncatedSvd<Real> leadingSvd(const PaddedRows<Real>& x, size_t terms, double tolerated = 0);

// Iteration ends once the residual |X' X v - sigma^2 v| of each term is below this share of the largest
// sigma^2.
inline constexpr double kLeadingSvdError = 1e-6;

} // namespace surflect
