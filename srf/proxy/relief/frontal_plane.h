// The plane that stands in for the object where one camera saw it and nothing is known of its depth: it faces
// the camera and holds the world's origin. An orthographic camera has such a plane wherever it stands; for a
// pinhole camera that does not have the origin before it, the plane is one scene unit away.
#pragma once

#include "srf/capture/camera.h"

#include <optional>

namespace surflect::relief {

// Depth along the viewing axis, scene units; may be negative for an orthographic camera.
double frontalDepth(const capture::Camera<AcquisitionSpace>& camera);

// A pixel position on the image plane at depth 1: x right, y up. A pinhole camera sees what lies at
// depth * (x, y, -1), an orthographic one (x, y, -depth). Empty where the distortion has no inverse.
std::optional<Vec2<double>> imagePoint(const capture::Lens& lens, capture::Pixel pixel);

// Where such a ray is at a depth.
Point3<CameraSpace, double> atDepth(const capture::Lens& lens, const Vec2<double>& imagePoint, double depth);

} // namespace surflect::relief
