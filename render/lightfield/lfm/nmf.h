// Non-negative factors of an arranged matrix.
//
// [Lee and Seung 1999] Lee, Seung: Learning the Parts of Objects by Non-Negative Matrix Factorization.
#pragma once

#include "render/lightfield/lfm/factors.h"
#include "render/lightfield/lfm/pca.h"
#include "surfel/base/time.h"

#include <cstdint>

namespace surflect::lfm {

// U >= 0 and V >= 0 by multiplicative updates  [Lee and Seung 1999; Chen et al. 2002, Appendix]. Columns of U
// sum to 1, the term with the largest sum of squares first; terms of zeros are left out. The weighted squared
// error never rises.
//
// Departures from the appendix, for the error never to rise: V is updated with the new U, not the old one,
// and takes over the sum of a column of U when that is normalised. For speed, each update is repeated
// kRepeats times with the products F V and F' U, which cost most, computed once  [Gillis and Glineur 2012].
PlainFactors nonnegativeFactors(ArrangedMatrix matrix, const FitOptions& options, uint64_t seed,
                                const Progress& progress);

inline constexpr int kRepeats = 4;

} // namespace surflect::lfm
