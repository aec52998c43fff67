// Where the coordinates of a capture count from. Surfels and meshes have float positions, which far from 0
// lie further apart than pixels do.
#pragma once

#include "srf/capture/capture.h"

#include <optional>

namespace surflect::capture {

// The point nearest to the viewing axes of all cameras, by least squares; none where they are fewer than
// three, or look along one line.
std::optional<Point3<AcquisitionSpace, double>> whereAxesMeet(const Capture& capture);

// Footprint of one pixel at a point, scene units; the median over views.
double pixelFootprint(const Capture& capture, const Point3<AcquisitionSpace, double>& point);

// How far rounding to float can move a point there along an axis, in pixels of the median view.
double roundingInPixels(const Capture& capture, const Point3<AcquisitionSpace, double>& point);

// Where cameras look: where their axes meet, else the middle of the cameras; none of a capture of one view,
// or where all cameras stand at one place.
std::optional<Point3<AcquisitionSpace, double>> middleOfScene(const Capture& capture);

// The original coordinates from which the capture should count, where rounding costs more than a tenth of a
// pixel: the middle of the scene, rounded to whole units, or to less where all cameras stand within one unit.
std::optional<Vec3<double>> nearerOrigin(const Capture& capture);

// Returns the capture with coordinates that count from another origin, to about 1e-15 of the larger.
Capture countedFrom(Capture capture, const Vec3<double>& origin);

} // namespace surflect::capture
