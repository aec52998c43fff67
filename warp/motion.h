// A warp over time: parameters are tracks, in the script's units (degrees, scene units).
#pragma once

#include "warp/handles.h"
#include "warp/lattice.h"
#include "warp/mesh_sequence.h"
#include "warp/skeletal_rig.h"
#include "warp/track.h"
#include "warp/warp.h"

#include <array>
#include <memory>
#include <variant>
#include <vector>

namespace surflect::warp {

// Axes and directions may have any length but zero. warp.h describes the warps.
struct RigidMotion {
  Track3 axis{0, 1, 0}, center;
  Track angleDeg;
  Track3 translate; // after the rotation
};

struct ScaleMotion {
  Track3 factor{1, 1, 1}, center;
};

// Rotates by angleDeg per `length` along the axis.
struct TwistMotion {
  Track3 axis, center;
  Track angleDeg, length = 1;
};

// Bends by angleDeg per `length` along the axis, towards the part of `direction` that is orthogonal to the
// axis.
struct BendMotion {
  Track3 axis, direction, center;
  Track angleDeg, length = 1;
};

// Scales across the axis by factor^(d / length) at distance d along it.
struct TaperMotion {
  Track3 axis, center;
  Track factor, length = 1;
};

struct SineMotion {
  Track3 axis, direction, center;
  Track amplitude, wavelength, phaseDeg;
};

struct ExpressionMotion {
  Expression x, y, z;              // in warpVariables
  Vec3<double> origin = {0, 0, 0}; // origin of the coordinates, see expressionWarp()
};

struct LatticeMotion {
  Track3 least, most;
  std::array<int, 3> divisions{}; // each 1..mostLatticeDivisions
  struct Point {
    std::array<int, 3> index; // counted from `least`: 0..divisions
    Track3 move;
  };
  std::vector<Point> points; // only points that move
};

struct HandlesMotion {
  std::shared_ptr<const Handles> handles;
  std::vector<Track3> targets; // one per handle
};

struct MeshMotion {
  std::shared_ptr<const MeshSequence> sequence;
  Track time; // frame of the sequence, or its second (MeshSequence::at)
};

struct SkeletonMotion {
  std::shared_ptr<const Rig> rig;
  Track seconds; // into its animation
};

using WarpMotion = std::variant<RigidMotion, ScaleMotion, TwistMotion, BendMotion, TaperMotion, SineMotion,
                                ExpressionMotion, LatticeMotion, HandlesMotion, MeshMotion, SkeletonMotion>;

// Warp at one time. Throws Error at the parameter's name in the script if a value is not finite or defines no
// warp (an axis or length of 0), and with the file that does not fit.
WarpPointer evaluateAt(const WarpMotion& motion, const ShotTime& time);

// Hash of the contents of all files that the motion reads; 0 without files.
uint64_t filesHash(const WarpMotion& motion);

} // namespace surflect::warp
