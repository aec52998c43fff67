// Smooth curves through points, and what is made along them: frames, tubes, braids, fur, and grids of
// triangles.
//
// [Wang 2008] Wang, Juettler, Zheng, Liu: Computation of rotation minimizing frames. ACM TOG 27(1), 2008.
#pragma once

#include "render/stage/surface.h"
#include "surfel/math/space.h"

#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace surflect::stage {

// A point of a curve with the thickness there.
struct CurvePoint {
  Vec3<double> position;
  double radius = 0;
};

// Once continuously differentiable curve with chord-length parameter and slopes; collinear points give a
// straight line.
class SmoothCurve {
public:
  // At least 2 points, 3 if closed, without equal neighbours; otherwise throws Error. `before` and `after`
  // extend an open curve; without them the curvature at its ends is zero.
  SmoothCurve(std::vector<CurvePoint> points, bool closed,
              const std::optional<CurvePoint>& before = std::nullopt,
              const std::optional<CurvePoint>& after = std::nullopt);

  double length() const { return lengths_.back(); }
  // Point at a fraction 0..1 of the length; the ends are exactly the given points.
  CurvePoint at(double fraction) const;
  Vec3<double> direction(double fraction) const; // unit

private:
  struct Parameter {
    size_t span;
    double u; // 0..1
  };
  Parameter parameterAt(double fraction) const;
  Eigen::Vector4d value(const Parameter& parameter) const;
  Eigen::Vector4d derivative(const Parameter& parameter) const;

  std::vector<Eigen::Vector4d> points_, slopes_; // position and radius; a closed curve repeats the first
  std::vector<double> steps_;                    // parameter difference to the next point
  std::vector<double> lengths_;                  // cumulative, kChords chords per span
};

// Tangent and two directions across it, right-handed: normal x binormal = tangent.
struct CurveFrame {
  Vec3<double> tangent, normal, binormal;
};

// Rotation minimizing frames, one per point [Wang 2008, section 4]. The first normal is as near to z as
// possible, or to x if the curve begins steeply. On a closed curve, whose last point equals the first, the
// remaining rotation is distributed evenly.
std::vector<CurveFrame> framesAlong(std::span<const CurvePoint> points, bool closed);

// Grid meshes, from which the shapes of the light stage are made.
struct SurfacePoint {
  Vec3<double> position, normal, tangent;
  Vec2<double> st; // texture coordinates
};

// Appends a grid of columns x rows squares over (s, t) in [0,1]^2, without triangles that have no area. Seen
// from outside, t points to the left of s. Throws Error if the surface would have more than kMostTriangles.
void addGridMesh(Surface& surface, int columns, int rows,
                 const std::function<SurfacePoint(double s, double t)>& point);

// Tubes along curves, and braids of tubes. Tangents run along the curve; texture coordinates run around and
// along a tube.

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

// Fur: short tapered tubes on a surface.
struct FurShape {
  int hairs;
  double length, radius;                    // radius at the root; hairs taper to a point
  Vec3<double> comb = Vec3<double>::Zero(); // displacement of the tips, in lengths
  double disorder = 0;                      // randomness of directions and lengths: 0 none, 1 wild
  uint64_t seed = 1;
};

// Hairs rooted evenly over the skin's area; the skin itself is not included. They start along its normals and
// bend towards `comb`. Each hair has the texture coordinates of its root, (0, 0) if the skin has none. Throws
// Error as addTube does.
Surface fur(const Surface& skin, const FurShape& shape);

} // namespace surflect::stage
