// Procedural shapes around the z axis. Tangents run around it, counter-clockwise seen from above. Texture
// coordinates run around and up a shape, and over each side of a box or disc.
#pragma once

#include "render/stage/surface.h"

#include <span>

namespace surflect::stage {

// Sphere of `segments` (3 or more) sides around the axis, and half as many from pole to pole.
Surface sphere(const Point3<AcquisitionSpace, double>& center, double radius, int segments);

// A sphere of radius rho(d) = radius (1 + amplitude sin(f d_x) sin(f d_y) sin(f d_z)) in direction d, with
// the normals of that shape. amplitude is below 1.
Surface bumpySphere(const Point3<AcquisitionSpace, double>& center, double radius, double amplitude,
                    double frequency, int segments);

// Cylinder closed by discs.
Surface cylinder(const Point3<AcquisitionSpace, double>& center, double radius, double height, int segments);

// Each face has segments x segments squares and one normal; tangents of upright faces are horizontal.
Surface box(const Point3<AcquisitionSpace, double>& center, const Vec3<double>& size, int segments);

// A point of a profile: distance from the axis, and height.
struct ProfilePoint {
  double radius, height;
};

// Surface of revolution: the profile rotated around z, with the outside to the right of its direction. The
// profile is a smooth curve through the points, with a crease where a point is given twice, and is horizontal
// on the axis. `closed`: flat discs at ends off the axis. Texture coordinates run around, and along the
// profile with its discs by length. Throws Error for fewer than 2 different points.
Surface lathe(std::span<const ProfilePoint> profile, bool closed, int segments);

} // namespace surflect::stage
