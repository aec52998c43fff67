// Scenes that a light field can show: the light is baked in, and the object stands as it was photographed.
#pragma once

#include "render/scene/scene.h"
#include "srf/capture/capture.h"
#include "surfel/math/space.h"

#include <span>

namespace surflect::lightfield {

// Throws Error unless the scene has no lights, or exactly the light of the photographs, and its warp keeps
// the object's points where they are. `rig` holds the photographs' views and at most one light.
void requireBaked(const scene::Scene& scene, const capture::Capture& rig,
                  std::span<const Point3<AcquisitionSpace>> points);

} // namespace surflect::lightfield
