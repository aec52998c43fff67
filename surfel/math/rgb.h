// Linear RGB: radiance, irradiance, intensity or weight, as the variable's name says.
#pragma once

namespace surflect {

struct Rgb {
  float r = 0, g = 0, b = 0;

  friend bool operator==(const Rgb&, const Rgb&) = default;
  friend Rgb operator+(Rgb x, Rgb y) { return {x.r + y.r, x.g + y.g, x.b + y.b}; }
  friend Rgb operator*(Rgb x, Rgb y) { return {x.r * y.r, x.g * y.g, x.b * y.b}; }
  friend Rgb operator*(float s, Rgb x) { return {s * x.r, s * x.g, s * x.b}; }
};

} // namespace surflect
