// Alternative maps of directions from a warped surface point back to acquisition space, beside the program's
// own (surfel/cloud.h).
//
// [Weyrich 2005] Weyrich, Pfister, Gross: Rendering Deformable Surface Reflectance Fields, TVCG 11(1).
// Symbols: R0 = (u0, v0, n0) the frame at rest; J the Jacobian of the warp; (u, v, w) = J R0;
//          u-bar, v-bar, n-bar an orthonormal frame made of u and v.
#pragma once

#include "render/method/renderer.h"
#include "srf/model/model.h"
#include "surfel/cloud.h"

#include <memory>
#include <optional>

namespace surflect::bench {

struct WarpedFrame {
  Mat3<double> rest, warped; // R0 and J R0
};

// Map from object space to acquisition space; empty if there is no frame. byInverseJacobian does not preserve
// lengths.
using DirectionsBack = std::optional<Mat3<double>> (*)(const WarpedFrame& frame);

std::optional<Mat3<double>> byPolarFactor(const WarpedFrame& frame);     // the program's own map
std::optional<Mat3<double>> byBisector(const WarpedFrame& frame);        // [Weyrich 2005, Eqs. 7 to 10]
std::optional<Mat3<double>> byGramSchmidt(const WarpedFrame& frame);     // u-bar along u
std::optional<Mat3<double>> byInverseJacobian(const WarpedFrame& frame); // J^-1 = R0 (u, v, w)^-1

// Renderer that differs from the surfel renderer in its map of directions; where `back` returns none, the
// program's own map is used. Scenes must have no environments. The model must outlive the result.
std::unique_ptr<method::Renderer> withDirections(const model::Model& model, DirectionsBack back);

} // namespace surflect::bench
