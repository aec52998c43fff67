// Pictures of a view with its object mask.
#pragma once

#include "srf/image/mask.h"
#include "srf/model/pack_source.h"
#include "surfel/geometry/ray_caster.h"

#include <cstddef>

namespace surflect::model {

struct MattedView {
  codec::ReflectanceStack stack;
  image::Mask object;
  size_t invalidTexels = 0; // as in ViewPictures
};

// Fills a missing matte from the silhouette of the impostor. Inside the silhouette's rim, where an impostor
// off by a pixel or two would show background, colours are continued from further inside.
MattedView fillMissingMatte(ViewPictures pictures, const capture::Camera<AcquisitionSpace>& camera,
                            const RayCaster<AcquisitionSpace>& impostor);

} // namespace surflect::model
