// Pictures of one view of a stage: traced, written to a file, and as read back from it.
#pragma once

#include "render/stage/stage_plan.h"
#include "srf/model/pack_source.h"
#include "surfel/base/progress.h"

#include <filesystem>

namespace surflect::stage {

// Version of how pictures are traced and written. A capture that was begun with another version is begun
// anew.
constexpr int kPictureFormat = 3;

// Pictures under the lights of the view's frames, in their order. `view` is an index into plan.capture.views.
TracedView trace(const StageScene& scene, const Stage& stage, const StagePlan& plan, size_t view,
                 const Progress& progress);

// Writes the view's file in half floats, or in single floats if values exceed their range; with an exposure,
// its brackets. Throws Error and Cancelled.
void write(const TracedView& traced, const Stage& stage, const StagePlan& plan, size_t view,
           const std::filesystem::path& folder, const Progress& progress);

// Pictures exactly as reading the file returns them, for a stage without exposure.
model::ViewPictures asRead(TracedView traced, const Progress& progress);

// Returns whether the view's pictures exist. Files appear complete, so checking the header is enough.
bool isFinished(const StagePlan& plan, size_t view, const std::filesystem::path& folder);

} // namespace surflect::stage
