// From a stage to a model, view by view: the whole capture is never there.
#pragma once

#include "render/stage/stage_file.h"
#include "srf/model/pack.h"
#include "surfel/base/progress.h"

#include <filesystem>
#include <functional>

namespace surflect::stage {

// The model that pack would make of the stage's capture, to the bit, but that every view is traced when its
// turn comes. The views that pack surveys are traced first and kept in folder/traced until all is done. The
// same call goes on where it was interrupted. Geometry is the stage's own, unless options name a mesh. Throws
// Error, also for a stage with an exposure, and Cancelled.
model::PackReport packStage(const Stage& stage, const std::filesystem::path& folder,
                            const model::PackOptions& options, const Progress& progress,
                            const std::function<void(const model::PackEstimate&)>& announce);

} // namespace surflect::stage
