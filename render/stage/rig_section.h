// Reads the [camera], [views] and [lights] sections of a stage file.
#pragma once

#include "render/scene/script_fields.h"
#include "srf/capture/capture.h"
#include "surfel/math/angle.h"

#include <filesystem>
#include <vector>

namespace surflect::stage {

struct StageRig {
  std::vector<capture::View> views;   // training views first
  std::vector<capture::Light> lights; // training lights first
  size_t trainingViews = 0, trainingLights = 0;
  Angle lightRadius;                        // angular radius of directional lights
  std::vector<std::filesystem::path> files; // files that were read
};

// `stage` has sections camera (unless another capture gives the cameras), views and lights, and optionally a
// center. Throws Error naming the entry.
StageRig asRig(const scene::Section& stage);

} // namespace surflect::stage
