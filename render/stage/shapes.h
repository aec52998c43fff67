// Shapes that are made here. z is their axis; tangents run round it, counter-clockwise seen from above, and
// texture coordinates go round and up a shape, and over each side of a box or disc.
#pragma once

#include "render/stage/surface.h"

#include <span>

namespace surflect::stage {

// `segments` (3 or more) triangles' sides round the axis, half as many from pole to pole.
Surface sphere(const Point3<AcquisitionSpace, double>& center, double radius, int segments);

// A sphere of radius rho(d) = radius (1 + amplitude sin(f d_x) sin(f d_y) sin(f d_z)) in direction d, with
// the normals of that shape. amplitude is below 1.
Surface bumpySphere(const Point3<AcquisitionSpace, double>& center, double radius, double amplitude,
                    double frequency, int segments);

// Closed by discs.
Surface cylinder(const Point3<AcquisitionSpace, double>& center, double radius, double height, int segments);

// Each face has segments x segments squares and one normal; tangents of upright faces are horizontal.
Surface box(const Point3<AcquisitionSpace, double>& center, const Vec3<double>& size, int segments);

// A point of a profile: how far from the axis, and how far up it.
struct ProfilePoint {
  double radius, height;
};

// The profile, turned round z: outside is to the right of the way along it, as of one that goes up outside.
// It is a smooth curve through the points, but that a point given twice is a crease. On the axis it is level
// there. `closed` by flat discs where it begins and ends off the axis. Texture coordinates go round, and
// along the profile with its discs by length. Throws Error with fewer than 2 points, or one point alone.
Surface lathe(std::span<const ProfilePoint> profile, bool closed, int segments);

} // namespace surflect::stage
