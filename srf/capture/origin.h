// Origin of a capture's coordinates. Surfels and meshes have float positions; far from 0, neighbouring floats
// are more than a pixel apart.
#pragma once

#include "srf/capture/capture.h"

#include <optional>

namespace surflect::capture {

// Point nearest to the viewing axes of all cameras, by least squares; none for fewer than three cameras, or
// if all look along one line.
std::optional<Point3<AcquisitionSpace, double>> whereAxesMeet(const Capture& capture);

// Size of one pixel at a point, scene units; the lower quartile over views, so that views from far away do
// not hide the detail that others show.
double pixelFootprint(const Capture& capture, const Point3<AcquisitionSpace, double>& point);

// Largest error of a coordinate of a point by rounding to float, in pixels of that size.
double roundingInPixels(const Capture& capture, const Point3<AcquisitionSpace, double>& point);

// Point that cameras look at: where their axes meet, or else the centre of the cameras. None for a single
// view, or if all cameras are at one place.
std::optional<Point3<AcquisitionSpace, double>> middleOfScene(const Capture& capture);

// New origin in original coordinates if rounding costs more than a tenth of a pixel: the middle of the scene,
// rounded to whole units, or finer if all cameras are within one unit.
std::optional<Vec3<double>> nearerOrigin(const Capture& capture);

// Returns the capture with coordinates relative to another origin, accurate to about 1e-15 of the larger one.
Capture countedFrom(Capture capture, const Vec3<double>& origin);

} // namespace surflect::capture
