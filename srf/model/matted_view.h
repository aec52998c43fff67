// The pictures of a view, and what they are sure to show.
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

// Without a matte the impostor's silhouette is the object. Its rim, where an impostor that is a pixel or two
// off would show background, continues what lies inside.
MattedView withMatte(ViewPictures pictures, const capture::Camera<AcquisitionSpace>& camera,
                     const RayCaster<AcquisitionSpace>& impostor);

} // namespace surflect::model
