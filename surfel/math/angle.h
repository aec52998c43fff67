// Angle type: radians inside, degrees only at input and output.
#pragma once

#include <numbers>

namespace surflect {

class Angle {
public:
  Angle() = default;
  static constexpr Angle fromRadians(double radians) { return Angle(radians); }
  static constexpr Angle fromDegrees(double degrees) { return Angle(degrees * std::numbers::pi / 180); }

  constexpr double radians() const { return radians_; }
  constexpr double degrees() const { return radians_ * 180 / std::numbers::pi; }

private:
  explicit constexpr Angle(double radians) : radians_(radians) {}
  double radians_ = 0;
};

} // namespace surflect
