// How far two captures of the same photographs are apart, by the protocol of render/evaluation/measure.h: of
// two seeds of a light stage, what the noise of its pictures lets any rendering reach.
#pragma once

#include "render/evaluation/measure.h"
#include "srf/capture/capture.h"
#include "surfel/base/progress.h"

namespace surflect::bench {

// Of all frames, the same in both but for their pixels; these have mattes. The exposure is the truth's.
// Throws Error where frames differ.
evaluation::Difference differenceOf(const capture::Capture& truth, const capture::Capture& again,
                                    const Progress& progress);

} // namespace surflect::bench
