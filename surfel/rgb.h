// Linear RGB: radiance, irradiance, intensity or weight, as the name of the variable says.
#pragma once

namespace surflect {

struct Rgb {
  float r = 0, g = 0, b = 0;

  friend bool operator==(const Rgb&, const Rgb&) = default;
  friend Rgb operator+(Rgb a, Rgb b) { return {a.r + b.r, a.g + b.g, a.b + b.b}; }
  friend Rgb operator*(Rgb a, Rgb b) { return {a.r * b.r, a.g * b.g, a.b * b.b}; }
  friend Rgb operator*(float s, Rgb a) { return {s * a.r, s * a.g, s * a.b}; }
};

} // namespace surflect
