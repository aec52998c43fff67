// Which photographs of a stage are taken, as the capture that they make.
#pragma once

#include "render/stage/stage_file.h"
#include "srf/capture/capture.h"

#include <cstddef>
#include <filesystem>
#include <vector>

namespace surflect::stage {

enum class StageFrames {
  all,      // all views under all lights: those for training, and the others for the test
  training, // training views under training lights
  test, // test views under all lights, and of training views at most eight, evenly chosen, under test lights
  deformed, // test views, or all where there are none, under all lights, for the test
};

struct StagePlan {
  capture::Capture
      capture; // EXRs of many layers, one a view; no file is there yet. Frames of a view are together
  std::vector<size_t> views; // of each view, its number in the stage, by which its noise differs
};

// Throws Error where there would be no frame.
StagePlan planOf(const Stage& stage, StageFrames which);

// All objects as one mesh.
TriangleMesh meshOf(const std::vector<StageObject>& objects);

} // namespace surflect::stage
