// Smooth curves through points, and frames that go along them.
//
// [Wang 2008] Wang, Juettler, Zheng, Liu: Computation of rotation minimizing frames. ACM TOG 27(1), 2008.
#pragma once

#include "surfel/math/space.h"

#include <optional>
#include <span>
#include <vector>

namespace surflect::stage {

// A point of a curve, and how thick it is there.
struct CurvePoint {
  Vec3<double> position;
  double radius = 0;
};

// Once continuously differentiable, with parameter and slopes by the distances of the points: what lies on a
// line stays on it.
class SmoothCurve {
public:
  // At least 2 points, 3 where the curve is closed, and no two neighbours at one place: throws Error.
  // `before` and `after` say where an open curve would come from and go to; without them it has no curvature
  // at its ends.
  SmoothCurve(std::vector<CurvePoint> points, bool closed,
              const std::optional<CurvePoint>& before = std::nullopt,
              const std::optional<CurvePoint>& after = std::nullopt);

  double length() const { return lengths_.back(); }
  // At a fraction 0..1 of the length; the ends are the points given, to the bit.
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

  std::vector<Eigen::Vector4d> points_, slopes_; // position and radius; of a closed curve the first once more
  std::vector<double> steps_;                    // parameter from each point to the next
  std::vector<double> lengths_;                  // up to each of kChords chords of each span
};

// `tangent` and two directions across it, right-handed: normal x binormal = tangent.
struct CurveFrame {
  Vec3<double> tangent, normal, binormal;
};

// One frame a point, turning as little as can be about the curve [Wang 2008, section 4]. The first normal is
// as near to z as it can be; where the curve begins steeply, to x. On a closed curve, whose last point is the
// first one, what is left of the turning is spread evenly.
std::vector<CurveFrame> framesAlong(std::span<const CurvePoint> points, bool closed);

} // namespace surflect::stage
