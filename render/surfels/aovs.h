// AOVs of the surfel renderer: depth, normal, position, rest, stretch, camera_blend and light_blend. A new
// AOV needs an entry in the table of computeAovs, and its name in render/scene/script.h.
#pragma once

#include "render/method/renderer.h"
#include "render/splat/splat_raster.h"
#include "srf/shading/shade.h"
#include "surfel/base/time.h"
#include "surfel/cloud.h"

#include <string>
#include <vector>

namespace surflect::surfels {

// Writes the AOVs that are asked for to `layers`, and erases all others there. The raster shows `deformed`,
// which is `rest` after the warp. `shaded` has one entry per surfel that the raster shows; its blend colours
// are needed for camera_blend and light_blend alone. Throws Cancelled.
void computeAovs(const std::vector<std::string>& asked, const splat::SplatRaster& raster,
                 const SurfelCloud& rest, const DeformedCloud& deformed, const shading::Shaded& shaded,
                 const Progress& progress, method::FrameLayers& layers);

// The ratio of the principal axes of a warped splat, 1 for a circle [Weyrich 2005, Fig. 15].
double stretchOf(const Vec3<double>& u, const Vec3<double>& v);

} // namespace surflect::surfels
