// Depth layers of a pixel: overlapping splats are grouped into surfaces, which fill the pixel front to back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::splat {

// A splat at a pixel. Colour is weighted by peak exp(-q), which is narrower by sqrt 2 than the splat's
// Gaussian exp(-q/2) and therefore blurs less. Its sum over splats is not 1, but weights are divided by their
// sum. Covered area is spread by a kernel that has the mass of the splat's Gaussian but is wider. Its sum
// over splats hardly ripples, even if the cloud lacks a surfel, and the area of a tiny splat is right at any
// position within a pixel.
struct Fragment {
  float order, tolerance, area;
  uint32_t splat; // index in the tile
};

struct Layer {
  size_t begin, end; // range of the sorted fragments
  float area;
  float alpha; // opacity of all layers up to this one, minus that of the layers before it
};

// Opacity of a covered area; see kOpaqueArea.
float saturated(float area);

// Divides the fragments of a pixel, sorted by depth from the nearest, into layers. Stops after the layer that
// fills the pixel, unless keepsHidden: the layers behind it then have alpha 0.
//
// A layer ends where the depth interval of the next fragment no longer touches those of the layer. Areas are
// fractions of one pixel and add up over layers: with S_k the area of layers 1 to k, layer k has the opacity
//   alpha_k = saturated(S_k) - saturated(S_(k-1)),
// shared among its fragments by weight and confidence. A surface behind an edge fills exactly the part of the
// pixel that the edge leaves open, and a surface split into two layers (grazing, creased or noisy) still adds
// up to 1. In both cases the usual compositing, in which layer k adds (1 - alpha so far) alpha_k, would let
// the background shine through.
void layersOf(const std::vector<Fragment>& fragments, bool keepsHidden, std::vector<Layer>& layers);

} // namespace surflect::splat
