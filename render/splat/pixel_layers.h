// What a pixel shows of splats one behind the other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::splat {

// A splat at a pixel. Its colour is weighted by peak exp(-q), a Gaussian narrower by sqrt 2: the weights are
// divided by their sum, so that they need not sum to 1 by themselves as Gaussians do that are wide enough for
// it and blur by their own width. The area it covers is spread by a kernel wider than the Gaussian, of the
// same mass: sums of that hardly ripple, even where the cloud has lost a surfel, and its area is right
// wherever in a pixel a tiny splat falls.
struct Fragment {
  float order, tolerance, area;
  uint32_t splat; // of the tile
};

struct Layer {
  size_t begin, end; // of the sorted fragments
  float area;
  float alpha; // of the pixel up to here, less that before
};

// How opaque an area is, see kFull.
float saturated(float area);

// Divides the fragments of one pixel, nearest first, into layers, down to the one that fills it.
//
// A layer ends where the depth interval of the next fragment no longer touches the ones so far. Areas are
// parts of one pixel, so those of layers add up: with S_k the area of layers 1 to k, layer k is given
//   alpha_k = saturated(S_k) - saturated(S_k-1),
// shared among its fragments by weight and confidence. A surface behind an edge fills exactly what the edge
// leaves open, and a surface that falls apart into two layers (grazing, creased or noisy) still adds up to 1.
// The usual alpha_k (1 - alpha) would let the background through there.
void layersOf(const std::vector<Fragment>& fragments, std::vector<Layer>& layers);

} // namespace surflect::splat
