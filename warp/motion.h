// A warp over time: its parameters are tracks, in the units of the script (degrees, scene units).
#pragma once

#include "warp/track.h"
#include "warp/warp.h"

#include <variant>

namespace surflect {

// Axes and directions need not be unit vectors. See warp.h for what each warp does.
struct RigidMotion {
  Track3 axis{0, 1, 0}, center;
  Track angleDeg;
  Track3 translate; // after the turn
};

struct ScaleMotion {
  Track3 factor{1, 1, 1}, center;
};

// Turns by angleDeg over every `length` along the axis.
struct TwistMotion {
  Track3 axis, center;
  Track angleDeg, length = 1;
};

// Bends by angleDeg over every `length` along the axis, towards the part of `direction` at right angles to
// it.
struct BendMotion {
  Track3 axis, direction, center;
  Track angleDeg, length = 1;
};

struct SineMotion {
  Track3 axis, direction, center;
  Track amplitude, wavelength, phaseDeg;
};

struct ExpressionMotion {
  Expression x, y, z; // in warpVariables
};

using WarpMotion =
    std::variant<RigidMotion, ScaleMotion, TwistMotion, BendMotion, SineMotion, ExpressionMotion>;

// The warp at one time. Throws Error, at the parameter's name in the script, where a parameter is not finite
// or makes no warp (an axis or length of 0).
WarpPointer freeze(const WarpMotion& motion, const ShotTime& time);

} // namespace surflect
