// Checks of the stored blocks: that all can be read, and that each keeps the error that pack allowed it.
#pragma once

#include "render/verify/check.h"
#include "srf/model/model.h"
#include "surfel/base/progress.h"

#include <vector>

namespace surflect::verify {

// Reads every block of the model. Its errors are measured against the capture that was packed, if it is
// given. Throws Error if the capture has other views, lights or photographs than the model, or cannot be
// read; and Cancelled.
std::vector<Check> blockChecks(const model::Model& model, const capture::Capture* capture,
                               const Bounds& bounds, const Progress& progress = {});

} // namespace surflect::verify
