// Tubes along curves, and braids of them. Tangents run along the curve; texture coordinates go round a tube
// and along it.
#pragma once

#include "render/stage/curve.h"
#include "render/stage/surface.h"

namespace surflect::stage {

// Appends the surface that a circle sweeps whose middle goes through the points: `sides` flat sides, at open
// ends half spheres, on a closed one (its last point is the first) none. Throws Error as addGridMesh does.
void addTube(Surface& surface, std::span<const CurvePoint> points, bool closed, int sides);

// Along the smooth curve through the points. Throws Error as SmoothCurve does.
Surface tube(std::span<const CurvePoint> points, bool closed, int segments);

struct BraidShape {
  int turns;         // how often each strand goes to and fro
  int fibres;        // of each of the three strands
  uint64_t seed = 1; // of how they lie
};

// Three strands woven along the smooth curve through the points, as wide as twice the radius there. The wide
// side lies along the first normal of framesAlong(). A strand is a core with fibres round it, in slight
// disorder.
Surface braid(std::span<const CurvePoint> points, bool closed, const BraidShape& shape);

} // namespace surflect::stage
