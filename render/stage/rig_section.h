// The cameras and lights of a stage file: its [camera], [views] and [lights].
#pragma once

#include "render/scene/script_fields.h"
#include "srf/capture/capture.h"
#include "surfel/math/angle.h"

#include <filesystem>
#include <vector>

namespace surflect::stage {

struct StageRig {
  std::vector<capture::View> views;   // those for training first
  std::vector<capture::Light> lights; // likewise
  size_t trainingViews = 0, trainingLights = 0;
  Angle lightRadius;                        // of directional lights
  std::vector<std::filesystem::path> files; // that were read for it
};

// `stage` has sections camera (but where another capture has the cameras), views and lights, and may have a
// center. Throws Error naming the entry.
StageRig asRig(const scene::Section& stage);

} // namespace surflect::stage
