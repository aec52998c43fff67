// Selection of a stage's photographs, as the capture that they form.
#pragma once

#include "render/scene/script_fields.h"
#include "render/stage/stage_file.h"
#include "srf/capture/capture.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <filesystem>
#include <string_view>
#include <vector>

namespace surflect::stage {

enum class StageFrames {
  all,      // all views under all lights: training pairs, and the others for testing
  training, // training views under training lights
  test,     // test views under all lights, and at most eight training views, evenly chosen, under test lights
  deformed, // test views, or all if there are none, under all lights, for testing
};

struct StagePlan {
  capture::Capture
      capture; // one multi-layer EXR per view; no file exists yet. Frames of a view are contiguous
  std::vector<size_t> views; // number of each view in the stage, which keys its noise
};

// Throws Error if there would be no frame.
StagePlan planOf(const Stage& stage, StageFrames which);

// All objects as one mesh.
TriangleMesh meshOf(const std::vector<StageObject>& objects);

// Values of a stage file. All functions throw Error with the bounds if a value is outside.
using scene::numberIn, scene::asVector;
double positive(const scene::Entry& entry); // 1e-9 to 1e9
int integerOr(const scene::Section& section, std::string_view key, int least, int most, int otherwise);
Point3<AcquisitionSpace, double> pointOr0(const scene::Section& section, std::string_view key);
Rgb asColor(const scene::Entry& entry, double least, double most); // [r, g, b]

} // namespace surflect::stage
