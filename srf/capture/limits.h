// How far away and how strong the things of a capture can be: beyond, products and squares in float
// arithmetic are not finite, or vanish.
#pragma once

namespace surflect::capture {

inline constexpr double kFarthest = 1e12; // coordinates in scene units, principal points in pixels
// Irradiance and intensity, in each channel.
inline constexpr float kLeastStrength = 1e-12f, kMostStrength = 1e12f;

} // namespace surflect::capture
