// Pictures from the shaded surfels of a raster.
#pragma once

#include "render/splat/splat_raster.h"
#include "srf/shading/shade.h"
#include "surfel/cloud.h"

#include <span>

namespace surflect::surfels {

// Image in RGBA, premultiplied, from the radiance of each entry of raster.visible, weighted by confidence if
// `shaded` has it, and with its alpha if it has that; nothing is seen through a layer. `memory` is used
// again.
image::Image developRadiance(const splat::SplatRaster& raster, const shading::Shaded& shaded,
                             image::Image memory = {});

// The same picture of a translucent object, whose layers are composited (translucent_layers.h). towardsView:
// of each visible surfel, in which its photographs were looked up.
image::Image developLayers(const splat::SplatRaster& raster, const SurfelCloud& cloud,
                           std::span<const Direction3<AcquisitionSpace>> towardsView,
                           const shading::Shaded& shaded, image::Image memory = {});

} // namespace surflect::surfels
