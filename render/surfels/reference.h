// The paper's pipeline for one frame, plainly: the specification against which renderFrame is tested, and the
// baseline for its speed. Runs in one thread, one look-up after the other.
//
// [Weyrich 2005]  Weyrich, Pfister, Gross: Rendering Deformable Surface Reflectance Fields, TVCG 11(1).
// [Buehler 2001]  Buehler et al.: Unstructured Lumigraph Rendering, SIGGRAPH.
//
// Symbols: p0, R0 = (u0, v0, n0) place and tangent frame of a surfel at rest; Psi the warp; p, u, v warped
//          place and tangents; L the look-up matrix; v, l directions at p to the viewer and to a light, E the
//          light's irradiance; c a captured view, k a captured light, E_k its irradiance at p0; I_ck the
//          photograph of view c under light k, a_c its alpha there, 1 for an opaque object; w_c, w_k
//          unstructured lumigraph weights; s visibility weight of a view.
//
//   p = Psi(p0),   u = (Psi(p0 + e u0) - Psi(p0 - e u0)) / 2e,   v likewise      [Weyrich 2005, Eq. 6]   (1)
//   L = R0 (u-bar, v-bar, n-bar)^T                                               [Weyrich 2005, Eq. 10]  (2)
//   penalty of view c:   (1 - cos(L v, direction from p0 to c)) / s                                      (3)
//   penalty of light k:  1 - cos(L l, direction from p0 to k)                                            (4)
//   w = ULR weights of the views or lights of least penalty   [Buehler 2001, §4; Weyrich 2005, §5.2]     (5)
//   radiance = sum_c w_c a_c  sum_l  sum_k w_k (E / E_k)  I_ck(pixel of p0 in view c)                    (6)
//   pixel = sum of radiances, weighted by splat and confidence  (render/splat/reference.h)               (7)
#pragma once

#include "render/surfels/frame.h"
#include "srf/model/model.h"

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace surflect::surfels {

// Decoded blocks, kept in memory for as long as this lives.
class DecodedBlocks {
public:
  explicit DecodedBlocks(codec::BlockCache& cache);

  // The block at a texel of a view; null on background.
  const codec::Block* at(uint32_t view, int x, int y);
  const codec::ViewFile& view(uint32_t view) const { return cache_.views()[view]; }

private:
  codec::BlockCache& cache_;
  std::vector<std::vector<std::shared_ptr<const codec::Block>>>
      blocks_; // per view and number; null: not read yet
};

struct ReferenceFrame {
  image::Image color; // RGBA, premultiplied
  size_t visible = 0, lookups = 0;
  std::map<std::string, double> seconds; // per stage of FrameStats::seconds, but for "aov"
};

// Splats are those of the fast splatter, so that two frames differ by their shading alone. The model is a
// full product of cameras and lights, without foreshortening; lights are directional or point lights without
// a gradient; the warp does not mirror. Approximations that the options allow are not used. Throws Error for
// other models and lights.
ReferenceFrame referenceFrame(const model::Model& model, const warp::Warp& warp,
                              const capture::Camera<ObjectSpace>& camera,
                              std::span<const scene::ShotLight> lights, const FrameOptions& options,
                              DecodedBlocks& blocks);

} // namespace surflect::surfels
