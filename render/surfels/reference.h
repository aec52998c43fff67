// The paper's pipeline for one frame, plainly: the specification against which renderFrame is tested, and the
// baseline for its speed. Runs in one thread, one look-up after the other.
//
// [Weyrich 2005]  Weyrich, Pfister, Gross: Rendering Deformable Surface Reflectance Fields, TVCG 11(1).
//
// Symbols: p0, R0 = (u0, v0, n0) place and tangent frame of a surfel at rest; Psi the warp; p, u, v warped
//          place and tangents; L the look-up matrix; v, l directions at p to the viewer and to a light.
//
//   p = Psi(p0),   u = (Psi(p0 + e u0) - Psi(p0 - e u0)) / 2e,   v likewise      [Weyrich 2005, Eq. 6]   (1)
//   L = R0 (u-bar, v-bar, n-bar)^T                                               [Weyrich 2005, Eq. 10]  (2)
//   radiance from directions L v, L l and irradiance at p  (srf/shading/reference.h)                     (3)
//   pixel = sum of radiances, weighted by splat and confidence  (render/splat/reference.h)               (4)
#pragma once

#include "render/surfels/frame.h"
#include "srf/model/model.h"

#include <map>
#include <string>

namespace surflect::surfels {

struct ReferenceFrame {
  image::Image color; // RGBA, premultiplied
  size_t visible = 0, lookups = 0;
  std::map<std::string, double> seconds; // per stage of FrameStats::seconds, but for "aov"
};

// Splats are those of the fast splatter, so that two frames differ by their shading alone. Lights are
// directional or point lights without a gradient; the warp does not mirror. Approximations that the options
// allow are not used. Throws Error for environments, and for a model whose frames cast shadows.
ReferenceFrame referenceFrame(const model::Model& model, const warp::Warp& warp,
                              const capture::Camera<ObjectSpace>& camera,
                              std::span<const scene::ShotLight> lights, const FrameOptions& options,
                              codec::BlockCache& cache);

} // namespace surflect::surfels
