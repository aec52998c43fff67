// Captures of a stage: photographs of all its views under all its lights.
#pragma once

#include "render/stage/stage_plan.h"
#include "surfel/base/progress.h"
#include "warp/warp.h"

#include <filesystem>

namespace surflect::stage {

// What bends the objects before they are photographed.
struct StageDeformation {
  const warp::Warp& warp;
  uint64_t hash; // of all that the warp depends on
};

struct StageReport {
  size_t views = 0, lights = 0, trainingFrames = 0, testFrames = 0, resumedViews = 0;
};

// Throws Error where there would be no frame, and where the folder holds anything but what captureStage has
// left there: to be asked before hours of other work.
void requireCapturable(const Stage& stage, const StageDeformation* deformation, StageFrames which,
                       const std::filesystem::path& folder);

// Writes one EXR of many layers a view, or brackets of PNGs, the geometry at rest and, last, transforms.json.
// A deformation goes with StageFrames::deformed: for `evaluate` with the same warp. The same command goes on
// where it was interrupted. Throws Error, also as requireCapturable does, and Cancelled. Memory: a picture of
// every light, and the file that they become.
StageReport captureStage(const Stage& stage, const StageDeformation* deformation, StageFrames which,
                         const std::filesystem::path& folder, const Progress& progress);

} // namespace surflect::stage
