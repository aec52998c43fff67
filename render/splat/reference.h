// EWA splatting, plainly: the specification that the fast splatter (render/splat/splat_raster.h) is tested
// against. One thread, double precision, and the weights of all splats at all pixels stored.
//
// [Zwicker 2001] Zwicker, Pfister, van Baar, Gross: EWA Volume Splatting.
// [Botsch 2005]  Botsch, Hornung, Zwicker, Kobbelt: High-Quality Surface Splatting on Today's GPUs.
//
// Symbols: q squared distance of a pixel's centre to a splat's, in standard deviations; Q the cut-off of q;
//          a area that a splat covers of a pixel, g its Gaussian; d depth (as an order, see splat.h) and e
//          its tolerance; S_k area of the layers 1 to k; alpha_k opacity of layer k; w weight of a splat at a
//          pixel.
//
//   g = peak exp(-q),   a = peak (6 / Q) (1 - q / Q)^2                     where q <= Q            (1)
//   a splat extends a layer where d - e <= max (d + e) of the layer's splats so far, nearest first  (2)
//   alpha_k = saturated(S_k) - saturated(S_(k-1))                                                   (3)
//   w = alpha_k g / (sum of g over the layer)                                                       (4)
//   colour = sum over the layers of alpha_k (sum of w c x) / (sum of w c), c the confidence         (5)
#pragma once

#include "render/splat/splat.h"
#include "srf/image/image.h"

#include <cstdint>
#include <span>
#include <vector>

namespace surflect::splat {

struct ReferenceWeight {
  uint32_t splat; // of the cloud
  double weight;
  bool endsLayer; // the last splat of its layer
};

struct ReferenceRaster {
  int width = 0, height = 0;
  size_t splats = 0;                                 // of the cloud
  size_t drawn = 0, backFacing = 0;                  // splats
  std::vector<std::vector<ReferenceWeight>> weights; // per pixel, front to back
  std::vector<double> alpha;                         // per pixel: the sum of its weights
  std::vector<double> depth; // per pixel, of the layer at half of alpha; else infinity
};

ReferenceRaster referenceRaster(const capture::Camera<ObjectSpace>& camera, const Splats& splats,
                                const SplatOptions& options = {});

// Splats with a weight at any pixel, ascending.
std::vector<uint32_t> visibleSplats(const ReferenceRaster& raster);

// attributes: #splats x channels, channels of one splat together. confidence: #splats, or empty for all
// equal. Returns sums that are premultiplied by alpha.
image::Image blend(const ReferenceRaster& raster, std::span<const float> attributes, int channels,
                   std::span<const float> confidence = {});

} // namespace surflect::splat
