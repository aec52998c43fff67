#include "render/stage/curve.h"

#include "surfel/base/error.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace surflect::stage {

using Vector = Vec3<double>;
using Vector4 = Eigen::Vector4d;

namespace {

constexpr size_t kChords = 32;

Vector4 packed(const CurvePoint& p) { return {p.position.x(), p.position.y(), p.position.z(), p.radius}; }

double distance(const Vector4& a, const Vector4& b) { return (b - a).head<3>().norm(); }

// Slope at b of the parabola through a, b and c.
Vector4 middleSlope(const Vector4& a, const Vector4& b, const Vector4& c) {
  const double before = distance(a, b), after = distance(b, c);
  return (after / before * (b - a) + before / after * (c - b)) / (before + after);
}

// Vector reflected in the plane orthogonal to `axis`.
Vector mirrored(const Vector& v, const Vector& axis) {
  return v - 2 * axis.dot(v) / axis.squaredNorm() * axis;
}

} // namespace

SmoothCurve::SmoothCurve(std::vector<CurvePoint> points, bool closed, const std::optional<CurvePoint>& before,
                         const std::optional<CurvePoint>& after) {
  const size_t least = closed ? 3 : 2;
  if (points.size() < least)
    throw Error::mismatch(std::to_string(least) + " points or more", std::to_string(points.size()));
  for (const CurvePoint& p : points) points_.push_back(packed(p));
  if (closed) points_.push_back(points_.front());
  const size_t count = points_.size(), last = count - 1;
  for (size_t i = 0; i < last; ++i) {
    steps_.push_back(distance(points_[i], points_[i + 1]));
    if (!(steps_.back() > 0))
      throw Error::mismatch("a place other than that of the point before", "the same")
          .at("[" + std::to_string((i + 1) % points.size()) + "]");
  }
  slopes_.resize(count);
  for (size_t i = 1; i < last; ++i) slopes_[i] = middleSlope(points_[i - 1], points_[i], points_[i + 1]);
  const Vector4 first = (points_[1] - points_[0]) / steps_.front(),
                final = (points_[last] - points_[last - 1]) / steps_.back();
  if (closed) {
    slopes_[0] = slopes_[last] = middleSlope(points_[last - 1], points_[0], points_[1]);
  } else { // zero second derivative, if there is a neighbour
    slopes_[0] = before     ? middleSlope(packed(*before), points_[0], points_[1])
                 : last > 1 ? Vector4((3 * first - slopes_[1]) / 2)
                            : first;
    slopes_[last] = after      ? middleSlope(points_[last - 1], points_[last], packed(*after))
                    : last > 1 ? Vector4((3 * final - slopes_[last - 1]) / 2)
                               : final;
  }
  lengths_.push_back(0);
  Vector4 previous = points_[0];
  for (size_t i = 0; i < last; ++i)
    for (size_t k = 1; k <= kChords; ++k) {
      const Vector4 next = value({i, static_cast<double>(k) / kChords});
      lengths_.push_back(lengths_.back() + distance(previous, next));
      previous = next;
    }
}

SmoothCurve::Parameter SmoothCurve::parameterAt(double fraction) const {
  if (fraction >= 1) return {steps_.size() - 1, 1};
  const double target = std::max(0.0, fraction) * length();
  const size_t chord = static_cast<size_t>(std::upper_bound(lengths_.begin(), lengths_.end() - 1, target) -
                                           lengths_.begin() - 1);
  const double chordLength = lengths_[chord + 1] - lengths_[chord];
  const double within = chordLength > 0 ? (target - lengths_[chord]) / chordLength : 0;
  return {chord / kChords, (static_cast<double>(chord % kChords) + within) / kChords};
}

// Hermite cubic.
Vector4 SmoothCurve::value(const Parameter& parameter) const {
  const auto& [i, u] = parameter;
  const double v = 1 - u, h = steps_[i];
  return v * v * (1 + 2 * u) * points_[i] + u * u * (1 + 2 * v) * points_[i + 1] +
         h * u * v * (v * slopes_[i] - u * slopes_[i + 1]);
}

Vector4 SmoothCurve::derivative(const Parameter& parameter) const {
  const auto& [i, u] = parameter;
  const double v = 1 - u;
  return 6 * u * v / steps_[i] * (points_[i + 1] - points_[i]) + v * (1 - 3 * u) * slopes_[i] +
         u * (3 * u - 2) * slopes_[i + 1];
}

CurvePoint SmoothCurve::at(double fraction) const {
  const Vector4 p = value(parameterAt(fraction));
  return {p.head<3>(), p[3]};
}

Vector SmoothCurve::direction(double fraction) const {
  return derivative(parameterAt(fraction)).head<3>().stableNormalized();
}

std::vector<CurveFrame> framesAlong(std::span<const CurvePoint> points, bool closed) {
  const size_t count = points.size(), last = count - 1;
  std::vector<CurveFrame> frames(count);
  for (size_t i = 0; i < count; ++i) {
    const auto position = [&](size_t k) -> const Vector& { return points[k].position; };
    const bool isEnd = i == 0 || i == last;
    const Vector back = i > 0 ? position(i) - position(i - 1) : position(0) - position(last - 1),
                 forth = i < last ? position(i + 1) - position(i) : position(1) - position(0);
    const Vector along = !isEnd || closed ? Vector(back.stableNormalized() + forth.stableNormalized())
                         : i == 0         ? forth
                                          : back;
    frames[i].tangent = along.stableNormalized();
  }
  if (closed) frames[last].tangent = frames[0].tangent;

  const Vector t0 = frames[0].tangent;
  const Vector upward = std::abs(t0.z()) < 0.7 ? Vector(Vector::UnitZ()) : Vector(Vector::UnitX());
  frames[0].normal = (upward - upward.dot(t0) * t0).normalized();
  for (size_t i = 0; i < last; ++i) {
    const Vector step = points[i + 1].position - points[i].position;
    const Vector normal = mirrored(frames[i].normal, step), tangent = mirrored(frames[i].tangent, step);
    const Vector turn = frames[i + 1].tangent - tangent;
    const Vector carried = turn.squaredNorm() > 0 ? mirrored(normal, turn) : normal;
    const Vector& t = frames[i + 1].tangent;
    frames[i + 1].normal = (carried - carried.dot(t) * t).stableNormalized();
  }
  if (closed) {
    const Vector binormal = t0.cross(frames[0].normal);
    const double left =
        std::atan2(frames[last].normal.dot(binormal), frames[last].normal.dot(frames[0].normal));
    for (size_t i = 1; i < count; ++i) {
      const double angle = -left * static_cast<double>(i) / static_cast<double>(last);
      const Vector n = frames[i].normal, b = frames[i].tangent.cross(n);
      frames[i].normal = std::cos(angle) * n + std::sin(angle) * b;
    }
    frames[last].normal = frames[0].normal;
  }
  for (CurveFrame& frame : frames) frame.binormal = frame.tangent.cross(frame.normal);
  return frames;
}

} // namespace surflect::stage
