// Where the cameras and lights of a stage stand: about a centre, z up.
#pragma once

#include "srf/capture/camera.h"
#include "surfel/math/angle.h"

#include <span>
#include <vector>

namespace surflect::stage {

using RigDirection = Direction3<AcquisitionSpace, double>; // unit, away from the centre

// Azimuth from +x towards +y, elevation above the horizon.
RigDirection direction(Angle azimuth, Angle elevation);

// All steps at the first elevation (angle above the horizon), then those at the next; the first stands on +x.
std::vector<RigDirection> turntable(int steps, std::span<const Angle> elevations);

// Even over the zone of the sphere between two heights (z of the unit sphere), along a Fibonacci spiral that
// begins at azimuth `start`.
std::vector<RigDirection> spiral(int count, double lowest, double highest, Angle start);

// At `distance` from the centre, which it looks at, with z up; above and below the centre with y up.
capture::Camera<AcquisitionSpace> cameraAbout(const Point3<AcquisitionSpace, double>& center,
                                              const RigDirection& direction, double distance,
                                              const capture::Lens& lens);

} // namespace surflect::stage
