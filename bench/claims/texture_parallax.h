// "For nonuniform stretches, the object texture may appear to be shifted." [Weyrich 2005, §4.4]
//
// A plate with a spot, its impostor a parallel plane at the height h, seen at the angle theta from a captured
// direction, both scaled by (s_x, s_y, s_z). The frame of the impostor only stretches, so L is the identity,
// and the ray at the impostor point p* = S p, p_z = h, is answered by what p + t v meets:
//   x_answered = p_x - h tan(theta),     x_seen = p_x - (s_z / s_x) h tan(theta)
// The spot at x_answered is hence seen at s_x x_seen, displaced on the stretched plate by
//   s_x (x_seen - x_answered) = h tan(theta) (s_x - s_z).
#pragma once

#include "surfel/math/angle.h"
#include "surfel/math/space.h"

#include <filesystem>

namespace surflect::bench {

// The closed form above.
double statedParallax(double height, Angle theta, const Vec3<double>& factors);

// The same of a rendering: where the spot's centre lies on the stretched plate, against where it should.
double measuredParallax(double height, Angle theta, const Vec3<double>& factors,
                        const std::filesystem::path& work);

} // namespace surflect::bench
