// Smooth curves through points, and frames along them.
//
// [Wang 2008] Wang, Juettler, Zheng, Liu: Computation of rotation minimizing frames. ACM TOG 27(1), 2008.
#pragma once

#include "surfel/math/space.h"

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

} // namespace surflect::stage
