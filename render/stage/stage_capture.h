// Captures of a stage: photographs of all its views under all its lights.
#pragma once

#include "render/stage/stage_plan.h"
#include "surfel/base/progress.h"
#include "warp/warp.h"

#include <filesystem>

namespace surflect::stage {

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

} // namespace surflect::stage
