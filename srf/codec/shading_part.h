// What the shading queue is asked.
#pragma once

#include "srf/codec/light_rows.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace surflect::codec {

// After [Weyrich 2005, Table 2], whose operation is one look-up for one surfel, camera and light. Here all
// lights of a surfel and camera are one operation: they share the position, hence blocks and texels, and by
// X ~ E A their weights fold into A before any texel is touched.
struct ShadingOp {
  uint32_t target = 0; // the surfel that is shaded
  uint32_t view = 0;   // the camera
  float x = 0, y = 0;  // where the camera sees it, in pixels, centres at +0.5; clamped to the image
  float weight = 0;    // of the camera
  uint32_t rowBegin = 0, rowEnd = 0; // the lights
};

// Operations with targets of their own, and rows that outlast them.
struct ShadingPart {
  std::span<const ShadingOp> ops;
  const LightRows* rows = nullptr;
  size_t targets = 0;
};

} // namespace surflect::codec
