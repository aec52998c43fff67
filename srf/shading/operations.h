// Operations of the shading queue, after [Weyrich 2005, Table 2]. An operation of the paper is one look-up
// for a surfel, camera and light. Here, an operation has one camera and all lights: the lights share a
// position in the image, hence blocks and texels. Light weights are applied to the factor A of X ~ E A before
// any texel is read.
#pragma once

#include "srf/weights/light_rows.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace surflect::shading {

struct ShadingOp {
  uint32_t target = 0; // index of the radiance that the operation adds to
  uint32_t view = 0;   // index of the view
  float x = 0, y = 0;  // projection of the surfel in pixels, centres at +0.5; clamped to the image
  float weight = 0;    // camera weight
  uint32_t rowBegin = 0, rowEnd = 0; // light row: a range of weights::LightRows::lights
};

// Operations that can be executed independently of others. The rows must outlive the part.
struct ShadingPart {
  std::span<const ShadingOp> ops;
  const weights::LightRows* rows = nullptr;
  size_t targets = 0;
};

} // namespace surflect::shading
