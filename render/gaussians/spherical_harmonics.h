// Real spherical harmonics up to degree 3, and their fit to colours seen from some directions.
//
// [Sloan 2008] Sloan: Stupid Spherical Harmonics (SH) Tricks, GDC (appendix A2: polynomial forms).
// [Kerbl 2023] Kerbl, Kopanas, Leimkuehler, Drettakis: 3D Gaussian Splatting for Real-Time Radiance Field
//              Rendering, TOG 42(4): degree 3, evaluated in the direction from the viewer to the Gaussian.
//
// Coefficients are in the order 00, 1-1, 10, 11, 2-2, .. 33, with the Condon-Shortley phase: (x, y, z) enter
// degree 1 as -y, z, -x.
#pragma once

#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

namespace surflect::gaussians {

inline constexpr int kHighestDegree = 3;
constexpr size_t coefficientsOf(int degree) { return static_cast<size_t>((degree + 1) * (degree + 1)); }
inline constexpr size_t kMostCoefficients = coefficientsOf(kHighestDegree);

// Y_00, the constant harmonic: 1 / (2 sqrt(pi)) = 0.28209...
inline constexpr double kConstantHarmonic = 0.5 * std::numbers::inv_sqrtpi;

// All harmonics at a unit direction. Orthonormal over the sphere.  [Sloan 2008, appendix A2]
std::array<double, kMostCoefficients> harmonicsAt(const Vec3<double>& d);

using Color = std::array<double, 3>;

// Coefficients of one colour function.
using Coefficients = std::array<Color, kMostCoefficients>;

// Fits samples of a colour by regularised least squares: with samples c_k of weights w_k in directions d_k,
//   minimise  sum_k w_k |c_k - sum_j a_j Y_j(d_k)|^2  +  lambda sum_k w_k  sum_j (l_j (l_j + 1))^2 |a_j|^2,
// where l_j is the degree of Y_j: samples of one hemisphere leave the other free, and the second term keeps
// it smooth (the squared Laplacian over the sphere). The constant is not penalised, so that a constant colour
// comes back without rounding, in a_0 alone. `harmonics`: those of each sample. Without weight, all
// coefficients are 0. Those beyond the degree are 0.
Coefficients fitted(std::span<const std::array<double, kMostCoefficients>> harmonics,
                    std::span<const Color> colors, std::span<const double> weights, int degree);

} // namespace surflect::gaussians
