// Packs a stage into a model view by view, without storing the whole capture.
#pragma once

#include "render/stage/stage_file.h"
#include "srf/model/pack.h"
#include "surfel/base/progress.h"

#include <filesystem>
#include <functional>

namespace surflect::stage {

// Writes the same model, bit by bit, as pack() from the stage's capture, but traces every view when it is
// needed. The views that select white level and light blend are traced first and kept in folder/traced until
// the end. The same call resumes an interrupted one. Geometry is the stage's own, unless options name a mesh.
// Throws Error, also for a stage with an exposure, and Cancelled.
model::PackReport packStage(const Stage& stage, const std::filesystem::path& folder,
                            const model::PackOptions& options, const Progress& progress,
                            const std::function<void(const model::PackEstimate&)>& announce);

} // namespace surflect::stage
