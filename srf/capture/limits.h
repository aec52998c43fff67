// Limits of a capture's coordinates and strengths. Beyond them, products and squares in float overflow or
// vanish.
#pragma once

namespace surflect::capture {

inline constexpr double kFarthest = 1e12; // coordinates in scene units, principal points in pixels
// Irradiance and intensity, in each channel.
inline constexpr float kLeastStrength = 1e-12f, kMostStrength = 1e12f;

} // namespace surflect::capture
