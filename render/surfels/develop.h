// Pictures from the shaded surfels of a raster.
#pragma once

#include "render/splat/splat_raster.h"
#include "srf/shading/shade.h"
#include "surfel/cloud.h"

#include <span>

namespace surflect::surfels {

// RGBA picture, premultiplied, from radiance, confidence and alpha of each entry of raster.visible; `shaded`
// may lack the last two. Layers hide what is behind them. `memory` is reused.
image::Image developRadiance(const splat::SplatRaster& raster, const shading::Shaded& shaded,
                             image::Image memory = {});

// RGBA picture, premultiplied, of a translucent object, whose layers are composited (translucent_layers.h).
// towardsView: for each visible surfel, the direction to the viewer in which its photographs were looked up.
image::Image developLayers(const splat::SplatRaster& raster, const SurfelCloud& cloud,
                           std::span<const Direction3<AcquisitionSpace>> towardsView,
                           const shading::Shaded& shaded, image::Image memory = {});

} // namespace surflect::surfels
