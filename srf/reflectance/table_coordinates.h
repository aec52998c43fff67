// Coordinates in which reflectance is tabulated: half vector and difference vector of the directions to light
// and viewer, in the surfel's own frame.
//
//   s = l + v,   h = s / max(|s|, s0),   d = (l - v) / 2                         [Rusinkiewicz 1998, §3]
//   p = (h_u, h_v) / (1 + c),            c = max(h_n, 0)
//   d' = d - d_n / (1 + c) (h + n)
//   e = |d'| (cos 2 phi, sin 2 phi),     phi the angle of d' in the plane of u and v
//
// Symbols: l, v unit directions to light and viewer in the frame (u, v, n) of the surfel; h unit half vector,
// p its stereographic projection; d difference vector, of length sin(theta_d); d' the same after the rotation
// that takes h to n by the shortest arc; e the same with its angle doubled. p and e lie in the unit disc.
//
// Reciprocity: exchanging light and viewer turns d into -d, and leaves p and e as they are, to the bit.
// Half turn: a half turn about n takes p to -p, and leaves e as it is.
// Continuity: e is continuous at d' = 0, where phi is undefined. For opposite directions s is 0, and h
// undefined: h is shortened where |s| < s0, so that p goes to 0. Below the horizon, h_n counts as 0.
//
// [Rusinkiewicz 1998] Rusinkiewicz: A New Change of Variables for Efficient BRDF Representation, Eurographics
// Workshop on Rendering.
#pragma once

#include "surfel/math/space.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace surflect::reflectance {

// Frame of a surfel: u along the fibres of the surface, v across them, n normal.
struct SurfelSpace;

template <class T = float> struct HalfDifference {
  T halfU = 0, halfV = 0;             // p
  T differenceU = 0, differenceV = 0; // e

  friend bool operator==(const HalfDifference&, const HalfDifference&) = default;
};

inline constexpr double kOppositeSum = 0.1; // s0

// p and e of unit directions to viewer and light.
template <class T>
HalfDifference<T> halfDifference(const Direction3<SurfelSpace, T>& view,
                                 const Direction3<SurfelSpace, T>& light) {
  const T sU = light.x() + view.x(), sV = light.y() + view.y(), sN = light.z() + view.z();
  const T length = std::max(std::sqrt(sU * sU + sV * sV + sN * sN), static_cast<T>(kOppositeSum));
  const T hU = sU / length, hV = sV / length, up = 1 + std::max(sN / length, T(0));
  const T slope = (light.z() - view.z()) / (2 * up);
  const T dU = (light.x() - view.x()) / 2 - slope * hU; // d'
  const T dV = (light.y() - view.y()) / 2 - slope * hV;
  const T size = std::max(std::sqrt(dU * dU + dV * dV), std::numeric_limits<T>::min());
  return {hU / up, hV / up, dU * (dU / size) - dV * (dV / size), 2 * dU * (dV / size)};
}

// Coordinates of the same pair of directions in a frame that is turned about n by `angle`, from u towards v.
template <class T> HalfDifference<T> turned(const HalfDifference<T>& at, Angle angle) {
  const auto cosine = static_cast<T>(std::cos(angle.radians()));
  const auto sine = static_cast<T>(std::sin(angle.radians()));
  const T cosine2 = cosine * cosine - sine * sine, sine2 = 2 * cosine * sine; // e turns twice as far
  return {cosine * at.halfU + sine * at.halfV, cosine * at.halfV - sine * at.halfU,
          cosine2 * at.differenceU + sine2 * at.differenceV,
          cosine2 * at.differenceV - sine2 * at.differenceU};
}

// Coordinates with both angles set to 0, for isotropic surfaces: |p| and |e| in place of p_u and e_u.
template <class T> HalfDifference<T> withoutAngles(const HalfDifference<T>& at) {
  return {std::sqrt(at.halfU * at.halfU + at.halfV * at.halfV), 0,
          std::sqrt(at.differenceU * at.differenceU + at.differenceV * at.differenceV), 0};
}

// Link between tabulated values and reflectance, radiance over the irradiance of a surface that faces the
// light:
//   X = k T,   k = sqrt(c_l / c_v)
// Symbols: c_l, c_v cosines of light and viewer. T = f sqrt(c_l c_v), with the BRDF f = X / c_l, keeps its
// value when light and viewer are exchanged, and grows less than f at grazing directions. The cosine of the
// viewer counts as at least kLeastCosine.
inline constexpr double kLeastCosine = 0.1;
template <class T> T tableLink(T cosLight, T cosView) {
  return std::sqrt(std::max(cosLight, T(0)) / std::max(cosView, static_cast<T>(kLeastCosine)));
}

} // namespace surflect::reflectance
