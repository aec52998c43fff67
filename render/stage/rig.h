// Positions of a stage's cameras and lights around a centre, z up.
#pragma once

#include "render/scene/script_fields.h"
#include "srf/capture/camera.h"
#include "srf/capture/capture.h"
#include "surfel/math/space.h"

#include <filesystem>
#include <span>
#include <vector>

namespace surflect::stage {

using RigDirection = Direction3<AcquisitionSpace, double>; // unit, away from the centre

// Direction by azimuth from +x towards +y and elevation above the horizon.
RigDirection direction(Angle azimuth, Angle elevation);

// Directions of a turntable: all steps at the first elevation (angle above the horizon), then at the next;
// the first is +x.
std::vector<RigDirection> turntable(int steps, std::span<const Angle> elevations);

// Even directions in the zone between two heights (z of the unit sphere), along a Fibonacci spiral from
// azimuth `start`.
std::vector<RigDirection> spiral(int count, double lowest, double highest, Angle start);

// Camera at `distance` from the centre, looking at it, with z up; directly above and below with y up.
capture::Camera<AcquisitionSpace> cameraAbout(const Point3<AcquisitionSpace, double>& center,
                                              const RigDirection& direction, double distance,
                                              const capture::Lens& lens);

// Reads the [camera], [views] and [lights] sections of a stage file.
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
