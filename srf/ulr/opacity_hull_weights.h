// Visibility weights on an opacity hull. The hull is not the object: what it hides may be air, and near its
// outline photographs from both sides of the horizon must blend. So a view counts wherever its picture holds
// the surfel, and only the border of the picture and its resolution lower the weight.
#pragma once

#include "srf/ulr/visibility_weights.h"

namespace surflect::ulr {

// Weights of all surfels. Throws Cancelled.
VisibilityWeights opacityHullWeights(const SurfelCloud& cloud,
                                     std::span<const capture::Camera<AcquisitionSpace>> views,
                                     const Progress& progress = {});

} // namespace surflect::ulr
