#include "render/splat/reference.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

namespace surflect::splat {

namespace {

constexpr double Q = kCutoffSigmas * kCutoffSigmas;

// A splat at a pixel.
struct ExactFragment {
  double order, tolerance, gaussian, area;
  uint32_t splat;
};

// Calls draw(x, y, fragment) for each pixel centre with q <= Q  (1).
template <class Draw> void rasterize(const Footprint& f, uint32_t splat, Draw draw) {
  for (int y = f.box.y0; y < f.box.y1; ++y)
    for (int x = f.box.x0; x < f.box.x1; ++x) {
      const double dx = x + 0.5 - f.x, dy = y + 0.5 - f.y;
      const double across = dx + double{f.skew} * dy;
      const double q = f.xx * across * across + f.yy * dy * dy;
      if (!(q <= Q)) continue;
      const double order = f.order + f.orderX * dx + f.orderY * dy, rest = 1 - q / Q;
      draw(x, y,
           ExactFragment{order, f.tolerance, f.peak * std::exp(-q), f.peak * 6 / Q * rest * rest, splat});
    }
}

// Opacity of a covered area: 0 up to 1 - kOpaqueArea, 1 from kOpaqueArea on.
double saturated(double area) {
  constexpr double full = kOpaqueArea;
  return std::clamp((area - (1 - full)) / (2 * full - 1), 0.0, 1.0);
}

// End of the layer that begins with fragments[begin], nearest first  (2). Once a layer's area exceeds
// kLayerAnchorArea, the layer extends no further back.
size_t endOfLayer(std::span<const ExactFragment> fragments, size_t begin) {
  double back = -std::numeric_limits<double>::infinity(), area = 0;
  size_t end = begin;
  for (; end < fragments.size(); ++end) {
    const ExactFragment& f = fragments[end];
    if (end > begin && f.order - f.tolerance > back) break;
    if (area < double{kLayerAnchorArea}) back = std::max(back, f.order + f.tolerance);
    area += f.area;
  }
  return end;
}

// End of the fragments that a pixel shows if layers are not searched for (SplatOptions), nearest first; 0 if
// there is no such end.
size_t endOfGrowth(std::span<const ExactFragment> fragments) {
  double back = std::numeric_limits<double>::infinity();
  for (const ExactFragment& f : fragments) back = std::min(back, f.order + f.tolerance);
  for (int growth = 0; growth < kLayerGrowths; ++growth) {
    const auto isBehind = [&](const ExactFragment& f) { return f.order - f.tolerance > back; };
    const auto end = static_cast<size_t>(std::ranges::find_if(fragments, isBehind) - fragments.begin());
    double area = 0;
    for (const ExactFragment& f : fragments.first(end)) {
      area += f.area;
      back = std::max(back, f.order + f.tolerance);
    }
    if (area >= double{kOpaqueArea} || end == fragments.size()) return end;
  }
  return 0;
}

struct ResolvedPixel {
  std::vector<ReferenceWeight> weights;
  double alpha = 0;
  double order = 0; // mean order of the layer at half of alpha
};

ResolvedPixel resolved(std::vector<ExactFragment> fragments, bool searchLayers) {
  std::ranges::sort(fragments, [](const ExactFragment& a, const ExactFragment& b) {
    return a.order != b.order ? a.order < b.order : a.splat < b.splat;
  });
  double area = 0; // S_k; initially over all layers
  for (const ExactFragment& f : fragments) area += f.area;
  const double half = saturated(area) / 2;

  const size_t grown = searchLayers ? 0 : endOfGrowth(fragments);

  ResolvedPixel pixel;
  bool hasOrder = false;
  area = 0;
  for (size_t begin = 0; begin < fragments.size() && pixel.alpha < 1;) {
    const size_t end = grown > 0 ? grown : endOfLayer(fragments, begin);
    double gaussians = 0, orders = 0;
    for (size_t i = begin; i < end; ++i) {
      area += fragments[i].area;
      gaussians += fragments[i].gaussian;
      orders += fragments[i].gaussian * fragments[i].order;
    }
    const double before = std::exchange(pixel.alpha, saturated(area));
    const double alpha = pixel.alpha - before; // (3)
    if (!hasOrder && pixel.alpha >= half) {
      pixel.order = orders / gaussians;
      hasOrder = true;
    }
    for (size_t i = begin; i < end && alpha > 0; ++i)
      pixel.weights.push_back(
          {fragments[i].splat, alpha * fragments[i].gaussian / gaussians, i + 1 == end}); // (4)
    begin = end;
  }
  return pixel;
}

} // namespace

ReferenceRaster referenceRaster(const capture::Camera<ObjectSpace>& camera, const Splats& splats,
                                const SplatOptions& options) {
  ReferenceRaster raster;
  raster.width = camera.lens.width;
  raster.height = camera.lens.height;
  raster.splats = splats.size();
  const size_t pixels = static_cast<size_t>(raster.width) * static_cast<size_t>(raster.height);
  std::vector<std::vector<ExactFragment>> fragments(pixels);
  for (uint32_t i = 0; i < splats.size(); ++i) {
    const auto result = footprintOf(camera, splats, i, options);
    if (const auto* footprint = std::get_if<Footprint>(&result)) {
      ++raster.drawn;
      rasterize(*footprint, i, [&](int x, int y, const ExactFragment& fragment) {
        fragments[static_cast<size_t>(y) * static_cast<size_t>(raster.width) + static_cast<size_t>(x)]
            .push_back(fragment);
      });
    } else {
      raster.backFacing += std::get<Rejection>(result) == Rejection::backFacing;
    }
  }
  for (auto& each : fragments) {
    ResolvedPixel pixel = resolved(std::exchange(each, {}), options.searchLayers);
    raster.weights.push_back(std::move(pixel.weights));
    raster.alpha.push_back(pixel.alpha);
    raster.depth.push_back(pixel.alpha > 0 ? depthOfOrder(camera.lens, pixel.order)
                                           : std::numeric_limits<double>::infinity());
  }
  return raster;
}

std::vector<uint32_t> visibleSplats(const ReferenceRaster& raster) {
  std::vector<uint32_t> visible;
  for (const auto& pixel : raster.weights)
    for (const ReferenceWeight& w : pixel) visible.push_back(w.splat);
  std::ranges::sort(visible);
  visible.erase(std::unique(visible.begin(), visible.end()), visible.end());
  return visible;
}

image::Image blend(const ReferenceRaster& raster, std::span<const float> attributes, int channels,
                   std::span<const float> confidence) {
  assert(channels > 0 && attributes.size() == raster.splats * static_cast<size_t>(channels));
  image::Image image(raster.width, raster.height, channels);
  const auto count = static_cast<size_t>(channels);
  std::vector<double> pixel(count), layer(count);
  for (size_t i = 0; i < raster.weights.size(); ++i) {
    double alpha = 0, trusted = 0; // sums of w and of w c over the layer
    std::ranges::fill(pixel, 0);
    for (const auto& [splat, weight, endsLayer] : raster.weights[i]) {
      const double wc = weight * (confidence.empty() ? 1 : double{confidence[splat]});
      for (size_t k = 0; k < count; ++k) layer[k] += wc * attributes[splat * count + k];
      alpha += weight;
      trusted += wc;
      if (!endsLayer) continue;
      for (size_t k = 0; k < count; ++k) pixel[k] += alpha / trusted * std::exchange(layer[k], 0); // (5)
      alpha = trusted = 0;
    }
    for (size_t k = 0; k < count; ++k) image.values[i * count + k] = static_cast<float>(pixel[k]);
  }
  return image;
}

} // namespace surflect::splat
