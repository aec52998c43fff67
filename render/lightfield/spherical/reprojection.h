// Point where a viewer's ray meets the image of a pencil: on the image plane, or on the heights above it.
//
// [Domingo 2007, §3.1] casts rays to the plane alone; depth is left there as future work.
// Symbols, in the coordinates of an image (pencil_image.h): e viewer, w vector of the ray, x(h) place where
// the ray passes at height h, g change of x with h, H(x) height of the object.
#pragma once

#include "render/lightfield/spherical/pencil_image.h"

#include <optional>

namespace surflect::spherical {

// x(0), where the ray meets the plane. The viewer is above the plane and the ray goes down: e.z > 0 > w.z.
Vec2<double> atPlane(const Vec3<double>& e, const Vec3<double>& w);
// x(h) = x(0) + h g, with g = (e - x(0)) / e.z
Vec2<double> slopeOf(const Vec3<double>& e, const Vec2<double>& atPlane);

// Whether the ray passes the object's sphere in front of the viewer, who may be in it.
bool passesSphere(const Vec3<double>& e, const Vec2<double>& atPlane, const Vec2<double>& slope);

// Height where the ray first comes from above to a solid part of the object: H(x(h)) = h. The ray starts at
// the viewer's height e.z, as nothing behind the viewer is met, or above the image's heights if the viewer is
// higher, and ends below the lowest of these. Found between steps of about a texel of the mip level. A
// crossing where alpha is below kSolid counts only if there is no solid one behind it. Empty if there is no
// crossing: behind an outline the ray passes through, as heights beside the object continue those on it. At a
// jump of heights within the object the ray meets a wall.
std::optional<double> heightMet(const PencilImage& image, const Vec2<double>& atPlane,
                                const Vec2<double>& slope, double viewer, double mip);

inline constexpr double kSolid = 0.5;
inline constexpr int kMostSteps = 64, kRefinements = 10;

// Heights between which heightMet() looks; none if `from` is not above `to`.
struct March {
  double from = 0, to = 0;
  int steps = 0;
};
March marchOf(const HeightRange& range, const Vec2<double>& slope, double viewer, int size, double mip);

// Mip level whose texels are as wide as `pixel`, the angle of a pixel, at the middle of the object; 0 if all
// are wider. The viewer is `distance` away.
double mipFor(const Sphere& sphere, int size, double distance, double pixel);

} // namespace surflect::spherical
