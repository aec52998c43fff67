// Tubes along curves, and braids of tubes. Tangents run along the curve; texture coordinates run around and
// along a tube.
#pragma once

#include "render/stage/curve.h"
#include "render/stage/surface.h"

namespace surflect::stage {

// Appends the tube of a circle swept along the points: `sides` flat sides, half spheres at open ends; a
// closed tube's last point equals the first. Throws Error as addGridMesh does.
void addTube(Surface& surface, std::span<const CurvePoint> points, bool closed, int sides);

// Tube along the smooth curve through the points. Throws Error as SmoothCurve does.
Surface tube(std::span<const CurvePoint> points, bool closed, int segments);

struct BraidShape {
  int turns;         // how often each strand goes to and fro
  int fibres;        // per strand
  uint64_t seed = 1; // of the fibres' positions
};

// Three strands woven along the smooth curve through the points; the radius there is half the width. The wide
// side lies along the first normal of framesAlong(). A strand is a core with fibres around it, in slight
// disorder.
Surface braid(std::span<const CurvePoint> points, bool closed, const BraidShape& shape);

} // namespace surflect::stage
