// Where the image of a pencil shows what a viewer's ray meets.
//
// [Domingo 2007, §3.1] casts rays to the image plane; depth is left there as future work. With depth, all
// pencils show the same point of the object: where the ray first meets its mesh. An image's heights tell
// whether the pencil sees the point, so no ray is followed through an image.
//
// Symbols, in the coordinates of an image (pencil_image.h): e viewer, w vector of the ray, x(h) place where
// the ray passes at height h, g change of x with h, H(x) height of the object.
#pragma once

#include "render/lightfield/spherical/pencil_image.h"

namespace surflect::spherical {

// x(0), where the ray meets the plane. The viewer is above the plane and the ray goes down: e.z > 0 > w.z.
Vec2<double> atPlane(const Vec3<double>& e, const Vec3<double>& w);
// g, where x(h) = x(0) + h g
Vec2<double> slopeOf(const Vec3<double>& w);

// Whether the ray passes the object's sphere in front of the viewer, who may be in it.
bool passesSphere(const Vec3<double>& e, const Vec2<double>& atPlane, const Vec2<double>& slope);

// Whether an image shows the point of the object at a place: 1 where its height H is that of the point, or
// less, falling to 0 where H is from kTolerance to 2 kTolerance texels in front of the point.
double visibility(const PencilImage& image, const Vec3<double>& place, double mip);

// Factor of a pencil's weight by the texel's alpha: 0 up to 1/2, 1 for opaque texels. Texels at outlines are
// partly covered, and mix surfaces.
double weightOfAlpha(double alpha);

inline constexpr double kTolerance = 2;
inline constexpr double kHidden =
    1.0 / 1024; // least factor of a weight: what all images hide is shown as well

// Mip level whose texels are as wide as `pixel`, the angle of a pixel, at the middle of the object; 0 if all
// are wider. The viewer is `distance` away.
double mipFor(const Sphere& sphere, int size, double distance, double pixel);

} // namespace surflect::spherical
