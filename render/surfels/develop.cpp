#include "render/surfels/develop.h"

#include "render/surfels/translucent_layers.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

namespace surflect::surfels {

namespace {

// Radiance and alpha of each visible surfel.
std::vector<float> premultiplied(const shading::Shaded& shaded) {
  std::vector<float> values(4 * shaded.radiance.size());
  for (size_t i = 0; i < shaded.radiance.size(); ++i) {
    const Rgb& color = shaded.radiance[i];
    std::ranges::copy(std::array{color.r, color.g, color.b, shaded.alpha[i]}, &values[4 * i]);
  }
  return values;
}

} // namespace

image::Image developRadiance(const splat::SplatRaster& raster, const shading::Shaded& shaded,
                             image::Image memory) {
  if (!shaded.alpha.empty())
    return splat::blend(raster, premultiplied(shaded), 4, shaded.confidence, std::move(memory));
  static_assert(sizeof(Rgb) == 3 * sizeof(float));
  const std::span values(reinterpret_cast<const float*>(shaded.radiance.data()), 3 * shaded.radiance.size());
  return splat::blendWithAlpha(raster, values, 3, shaded.confidence, std::move(memory));
}

image::Image developLayers(const splat::SplatRaster& raster, const SurfelCloud& cloud,
                           std::span<const Direction3<AcquisitionSpace>> towardsView,
                           const shading::Shaded& shaded, image::Image memory) {
  constexpr float kClearance = 4; // radii of a splat
  std::vector<Point3<AcquisitionSpace>> p0;
  std::vector<float> clearance;
  for (const uint32_t surfel : raster.visible) {
    p0.push_back(cloud.p0[surfel]);
    clearance.push_back(kClearance * cloud.radius[surfel]);
  }
  return compositeLayers(raster, premultiplied(shaded), shaded.confidence, {p0, towardsView, clearance},
                         std::move(memory));
}

} // namespace surflect::surfels
