// The pictures of one view of a stage: traced, in their file, and as who reads the file has them.
#pragma once

#include "render/stage/stage_plan.h"
#include "srf/model/pack_source.h"
#include "surfel/base/progress.h"

#include <filesystem>

namespace surflect::stage {

// Of how pictures come to be and are written: with another number, what was begun before is begun anew.
constexpr int kPictureFormat = 3;

// Under the lights of the view's frames, in their order. `view` is an index into plan.capture.views.
TracedView trace(const StageScene& scene, const Stage& stage, const StagePlan& plan, size_t view,
                 const Progress& progress);

// Writes the view's file, in half floats, or in single ones where these end below what is to be written; of a
// stage with an exposure its brackets. Throws Error and Cancelled.
void write(const TracedView& traced, const Stage& stage, const StagePlan& plan, size_t view,
           const std::filesystem::path& folder, const Progress& progress);

// What reading the file gives, to the bit; of a stage without exposure.
model::ViewPictures asRead(TracedView traced, const Progress& progress);

// Are the view's pictures there? Files appear whole, so that the header tells enough.
bool isFinished(const StagePlan& plan, size_t view, const std::filesystem::path& folder);

} // namespace surflect::stage
