// EWA splatting without acceleration: the specification against which render/splat/splat_raster.h is tested.
// Single-threaded, in double precision, with the weights of all splats stored for each pixel.
//
// [Zwicker 2001] Zwicker, Pfister, van Baar, Gross: EWA Volume Splatting.
// [Botsch 2005]  Botsch, Hornung, Zwicker, Kobbelt: High-Quality Surface Splatting on Today's GPUs.
//
// Symbols: q squared distance from a splat's centre to a pixel's, in standard deviations; Q cut-off of q;
//          a area of a pixel that a splat covers, g its Gaussian; d depth (as an order, see splat.h) and e
//          its tolerance; S_k area of layers 1 to k; alpha_k opacity of layer k; w weight of a splat at a
//          pixel; c confidence of a splat, x its attribute.
//
//   g = peak exp(-q),   a = peak (6 / Q) (1 - q / Q)^2                     where q <= Q            (1)
//   a splat extends a layer where d - e <= max (d + e) of the layer's splats so far, nearest first  (2)
//   alpha_k = saturated(S_k) - saturated(S_(k-1))                                                   (3)
//   w = alpha_k g / (sum of g over the layer)                                                       (4)
//   colour = sum over the layers of alpha_k (sum of w c x) / (sum of w c)                           (5)
#pragma once

#include "render/splat/splat.h"
#include "srf/image/image.h"

#include <cstdint>
#include <span>
#include <vector>

namespace surflect::splat {

struct ReferenceWeight {
  uint32_t splat; // index in the cloud
  double weight;
  bool endsLayer; // last splat of its layer
};

struct ReferenceRaster {
  int width = 0, height = 0;
  size_t splats = 0;                                 // in the cloud
  size_t drawn = 0, backFacing = 0;                  // numbers of splats
  std::vector<std::vector<ReferenceWeight>> weights; // per pixel, front to back
  std::vector<double> alpha;                         // per pixel: sum of weights
  std::vector<double> depth; // per pixel: depth of the layer at half of alpha; infinity if there is none
};

ReferenceRaster referenceRaster(const capture::Camera<ObjectSpace>& camera, const Splats& splats,
                                const SplatOptions& options = {});

// Splats with a weight in at least one pixel, ascending.
std::vector<uint32_t> visibleSplats(const ReferenceRaster& raster);

// Blends attributes: `channels` per splat, #splats in all. confidence: #splats, or empty if equal for all.
// The result is premultiplied by alpha.
image::Image blend(const ReferenceRaster& raster, std::span<const float> attributes, int channels,
                   std::span<const float> confidence = {});

} // namespace surflect::splat
