// Factorisation of vertex light field matrices into surface maps and view maps.
//
// [Chen 2002, §2.2, Appendix]; symbols as in factors.h.
//
// PCA: the mean over cells of each row is taken out, the rest is a truncated singular value decomposition.
// Terms are orthogonal, the strongest first, and progressive: the first k of K are those of k alone.
// NMF: all factors are >= 0, there is no mean, and terms are not progressive.
//
// Entries that were not observed count in no error. If the missing entries are whole rows or columns, PCA
// leaves these out. Otherwise terms are fitted to the observed entries by alternating least squares, for
// small errors of the first k of each k.
#pragma once

#include "render/lightfield/lfm/factors.h"
#include "surfel/base/time.h"

#include <cstddef>
#include <cstdint>

namespace surflect::lfm {

// Factors of samples and cells in which nothing was observed.

// Samples that were not observed get the mean of their values in observed cells, and the surface factors that
// fit these values best by least squares. Then cells that were not observed get the view factors that fit the
// values of observed samples. Values that are not finite are taken as 0; factors below 0 become 0 if
// `isPositive`.
void projectUnobserved(const LightFieldMatrix& matrix, const Observed& observed, bool isPositive,
                       Factors& factors);

struct FactorizationOptions {
  Factorization method = Factorization::pca;
  size_t terms = 3;           // at most
  double tolerance = 0;       // RMS errorOf() at which no further terms are added; 0: always `terms`
  float leastWeight = 0;      // of every finite entry in the fit; errorOf() leaves out entries of weight 0
  size_t mostIterations = 60; // of NMF; of PCA with missing entries for each term that is added
  // Iteration ends once the RMS error falls by less than this share in one; of PCA with missing entries the
  // product of the RMS errors of the first k terms of all k.
  double convergence = 1e-3;
  uint64_t seed = 1; // of the start of NMF
};

// Factors of a matrix. There are fewer terms than asked for if the matrix has no more (a constant matrix has
// none after its mean), up to rounding error. View maps and surface maps of a term have the same largest
// absolute value [Chen 2002, Appendix].
//
// Entries with a colour that is not finite are not observed. Rows and columns without an observed entry are
// projected: their factors fit the values given there, with 0 for values that are not finite.
// Throws Error if a weight is negative or not finite, or if NMF is given negative radiance; Cancelled.
Factors factorized(const LightFieldMatrix& matrix, const FactorizationOptions& options = {},
                   const Progress& progress = {});

} // namespace surflect::lfm
