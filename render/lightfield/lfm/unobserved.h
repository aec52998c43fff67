// Factors of samples and cells in which nothing was observed.
#pragma once

#include "render/lightfield/lfm/arranged_matrix.h"
#include "render/lightfield/lfm/factors.h"

namespace surflect::lfm {

// Samples that were not observed get the mean of their values in observed cells, and the surface factors that
// fit these values best by least squares. Then cells that were not observed get the view factors that fit the
// values of observed samples. Values that are not finite are taken as 0; factors below 0 become 0 if
// `isPositive`.
void projectUnobserved(const LightFieldMatrix& matrix, const Observed& observed, bool isPositive,
                       Factors& factors);

} // namespace surflect::lfm
