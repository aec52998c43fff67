// Ways to bring directions at a warped surface point back to where reflectance was captured, beside the one
// of surfel/lookup.h.
//
// [Weyrich 2005] Weyrich, Pfister, Gross: Rendering Deformable Surface Reflectance Fields, TVCG 11(1).
// Symbols: R0 = (u0, v0, n0) the frame at rest; J the Jacobian of the warp; (u, v, w) = J R0;
//          u-bar, v-bar, n-bar an orthonormal frame made of u and v.
#pragma once

#include "surfel/lookup.h"

#include <optional>

namespace surflect::bench {

// The frame at rest and its images under the warp's Jacobian, columns, w a third difference along n0.
struct WarpedFrame {
  Mat3<double> rest, warped;
};

// The first leg stays where it is, the second is made orthogonal to it: the frame of whoever takes u for a
// fibre that the material runs along. Empty where polarFrame is.
std::optional<OrthonormalFrame<double>> gramSchmidtFrame(const Vec3<double>& u, const Vec3<double>& v);

// Each takes directions of object space to acquisition space; empty where there is no frame. Those of
// inverseJacobian are yet to be normalised.
using DirectionsBack = std::optional<Mat3<double>> (*)(const WarpedFrame& frame);

std::optional<Mat3<double>> byPolarFactor(const WarpedFrame& frame);     // the program's own, lookup.h
std::optional<Mat3<double>> byBisector(const WarpedFrame& frame);        // [Weyrich 2005, Eqs. 7 to 10]
std::optional<Mat3<double>> byGramSchmidt(const WarpedFrame& frame);     // L of gramSchmidtFrame
std::optional<Mat3<double>> byInverseJacobian(const WarpedFrame& frame); // J^-1 = R0 (u, v, w)^-1

} // namespace surflect::bench
