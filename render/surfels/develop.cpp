#include "render/surfels/develop.h"

#include "render/splat/raster_tile.h"
#include "srf/weights/fades.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>
#include <vector>

namespace surflect::surfels {

namespace {

// Sines between which a layer behind becomes new: of 10 and of 30 degrees.
constexpr double kKnown = 0.17, kNew = 0.5;

// Means over the splats of a layer, by their weights.
struct LayerMean {
  std::array<float, 4> color{};
  Vec3<float> p0 = Vec3<float>::Zero(), towardsView = Vec3<float>::Zero();
  float clearance = 0;
};

class TileLayers {
public:
  TileLayers(const splat::RasterTile& tile, std::span<const float> values, std::span<const float> confidence,
             const LayerPlaces& places)
      : tile_(tile), values_(values), confidence_(confidence), places_(places) {}

  LayerMean meanOf(const splat::PixelLayer& layer) const {
    LayerMean mean;
    float weights = 0;
    for (const splat::Contribution& c : std::span(tile_.contributions).subspan(layer.begin, layer.count)) {
      const uint32_t i = tile_.column.data()[c.splat];
      const float w =
          c.weight * tile_.drawn.splats[c.splat].shape.peak * (confidence_.empty() ? 1 : confidence_[i]);
      weights += w;
      for (size_t k = 0; k < 4; ++k) mean.color[k] += w * values_[4 * i + k];
      mean.p0 += w * places_.p0[i].raw();
      mean.towardsView += w * places_.towardsView[i].raw();
      mean.clearance += w * places_.clearance[i];
    }
    for (float& value : mean.color) value /= weights;
    mean.p0 /= weights;
    mean.towardsView.normalize();
    mean.clearance /= weights;
    return mean;
  }

  // Composite of the layers of one pixel, nearest first.
  PixelComposite composite(std::span<const splat::PixelLayer> layers) {
    means_.clear();
    PixelComposite pixel;
    for (size_t k = 0; k < layers.size(); ++k) {
      const LayerMean& own = means_.emplace_back(meanOf(layers[k]));
      const float open = layers[k].alpha, hidden = std::max(0.f, splat::saturated(layers[k].area) - open);
      float known = 0;
      for (size_t j = 0; hidden > 0 && j < k; ++j)
        known +=
            splat::saturated(layers[j].area) * (1 - novelty(means_[j].p0, means_[j].towardsView, own.p0,
                                                            std::max(means_[j].clearance, own.clearance)));
      pixel.add(own.color, open, hidden * (1 - std::min(1.f, known)));
    }
    return pixel;
  }

private:
  const splat::RasterTile& tile_;
  std::span<const float> values_, confidence_;
  const LayerPlaces& places_;
  std::vector<LayerMean> means_;
};

} // namespace

float novelty(const Vec3<float>& front, const Vec3<float>& towardsView, const Vec3<float>& behind,
              float clearance) {
  const Vec3<float> way = behind - front;
  const float along = std::max(0.f, -towardsView.dot(way));
  const float aside = (way + along * towardsView).norm();
  const float distance = way.norm() + clearance;
  return distance > 0 ? static_cast<float>(weights::smoothStep(kKnown, kNew, double{aside / distance})) : 0;
}

void PixelComposite::add(const std::array<float, 4>& layer, float open, float hidden) {
  const float through = covered > 0 ? std::max(0.f, 1 - color[3] / covered) : 0;
  for (size_t k = 0; k < 4; ++k) color[k] += (open + hidden * through) * layer[k];
  covered += open;
}

image::Image compositeLayers(const splat::SplatRaster& raster, std::span<const float> values,
                             std::span<const float> confidence, const LayerPlaces& places, image::Image kept,
                             const Progress& progress) {
  assert(values.size() == 4 * raster.visible.size() && places.p0.size() == raster.visible.size());
  image::Image image = splat::blend(raster, values, 4, confidence, std::move(kept), progress);
  const int across = splat::tilesAlong(raster.width);
  tbb::parallel_for(size_t{0}, raster.tiles.size(), [&](size_t index) {
    progress.checkpoint();
    const splat::RasterTile& tile = raster.tiles[index];
    TileLayers layers(tile, values, confidence, places);
    const int x0 = static_cast<int>(index) % across * splat::kTileSize,
              y0 = static_cast<int>(index) / across * splat::kTileSize;
    for (auto first = tile.layers.begin(), last = first; first != tile.layers.end(); first = last) {
      last = std::find_if(first, tile.layers.end(),
                          [&](const splat::PixelLayer& layer) { return layer.pixel != first->pixel; });
      const int x = x0 + static_cast<int>(first->pixel) % splat::kTileSize,
                y = y0 + static_cast<int>(first->pixel) / splat::kTileSize;
      std::ranges::copy(layers.composite({first, last}).color, image.at(x, y).begin());
    }
  });
  return image;
}

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
                             image::Image memory, const Progress& progress) {
  if (!shaded.alpha.empty())
    return splat::blend(raster, premultiplied(shaded), 4, shaded.confidence, std::move(memory), progress);
  static_assert(sizeof(Rgb) == 3 * sizeof(float));
  const std::span values(reinterpret_cast<const float*>(shaded.radiance.data()), 3 * shaded.radiance.size());
  return splat::blendWithAlpha(raster, values, 3, shaded.confidence, std::move(memory), progress);
}

image::Image developLayers(const splat::SplatRaster& raster, const SurfelCloud& cloud,
                           std::span<const Direction3<AcquisitionSpace>> towardsView,
                           const shading::Shaded& shaded, image::Image memory, const Progress& progress) {
  constexpr float kClearance = 4; // radii of a splat
  std::vector<Point3<AcquisitionSpace>> p0;
  std::vector<float> clearance;
  for (const uint32_t surfel : raster.visible) {
    p0.push_back(cloud.p0[surfel]);
    clearance.push_back(kClearance * cloud.radius[surfel]);
  }
  return compositeLayers(raster, premultiplied(shaded), shaded.confidence, {p0, towardsView, clearance},
                         std::move(memory), progress);
}

} // namespace surflect::surfels
