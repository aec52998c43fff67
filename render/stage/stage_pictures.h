// Pictures of one view of a stage: traced, written to a file, and as read back from it.
#pragma once

#include "render/stage/stage_file.h"
#include "render/stage/stage_plan.h"
#include "srf/model/pack.h"
#include "srf/model/pack_source.h"
#include "surfel/base/time.h"
#include "warp/warp.h"

#include <filesystem>
#include <functional>

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

// Captures of a stage: photographs of all its views under all its lights.

// Deformation of the objects before they are photographed.
struct StageDeformation {
  const warp::Warp& warp;
  uint64_t hash; // of everything that the warp depends on
};

struct StageReport {
  size_t views = 0, lights = 0, trainingFrames = 0, testFrames = 0, resumedViews = 0;
};

// Throws Error if the capture would have no frame, and if the folder holds anything but an unfinished capture
// of this kind. Call it before hours of other work.
void requireCapturable(const Stage& stage, const StageDeformation* deformation, StageFrames which,
                       const std::filesystem::path& folder);

// Writes one multi-layer EXR per view, or brackets of PNGs, the geometry at rest and, last, transforms.json.
// A deformation requires StageFrames::deformed, and makes truth for `evaluate` with the same warp. The same
// call resumes an interrupted capture. Throws Error, also as requireCapturable does, and Cancelled. Memory:
// one picture per light, and the resulting file.
StageReport captureStage(const Stage& stage, const StageDeformation* deformation, StageFrames which,
                         const std::filesystem::path& folder, const Progress& progress);

// Packs a stage into a model view by view, without storing the whole capture.

// Writes the same model, bit by bit, as pack() from the stage's capture, but traces every view when it is
// needed. The views that select white level and light blend are traced first and kept in folder/traced until
// the end. The same call resumes an interrupted one. Geometry is the stage's own, unless options name a mesh.
// Throws Error, also for a stage with an exposure, and Cancelled.
model::PackReport packStage(const Stage& stage, const std::filesystem::path& folder,
                            const model::PackOptions& options, const Progress& progress,
                            const std::function<void(const model::PackEstimate&)>& announce);

} // namespace surflect::stage
