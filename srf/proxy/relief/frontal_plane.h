// Frontal plane: the geometry of an object that one camera saw at unknown depth. It faces the camera and
// contains the world's origin. If a pinhole camera does not have the origin in front of it, the plane is one
// scene unit away.
#pragma once

#include "srf/capture/camera.h"

#include <optional>

namespace surflect::relief {

// Depth of the plane along the viewing axis, scene units; may be negative for an orthographic camera.
double frontalDepth(const capture::Camera<AcquisitionSpace>& camera);

// Pixel position on the image plane at depth 1: x right, y up. A pinhole camera sees points depth * (x, y,
// -1), an orthographic one (x, y, -depth). Empty where the distortion has no inverse.
std::optional<Vec2<double>> imagePoint(const capture::Lens& lens, capture::Pixel pixel);

// Point at a depth on the ray through an image point.
Point3<CameraSpace, double> atDepth(const capture::Lens& lens, const Vec2<double>& imagePoint, double depth);

} // namespace surflect::relief
