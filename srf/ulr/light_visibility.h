// Shadow states: how much of a surface element each captured light reached. Lit surfels are shown by
// photographs that were taken in light, shadowed surfels by those taken in shadow. Not in the papers.
#pragma once

#include "srf/capture/rig.h"
#include "srf/ulr/visibility_weights.h"
#include "surfel/occluders.h"

namespace surflect::ulr {

// Viewpoints at the lights, so that lights are treated as views are.
std::vector<capture::Viewpoint<AcquisitionSpace>> viewpointsOf(std::span<const capture::Light> lights);

// Fade of light at the terminator, where coarse occluders cannot tell a surfel that faces the light from one
// that does not: 0 for cosines of light and normal below 0, 1 above 0.1.
inline double terminatorFade(double cosine) { return smoothStep(0, 0.1, cosine); }

// Part of the element around each surfel that each light reaches, 0..1: 1 in light, 0 in a cast or attached
// shadow, in between within visibilityRadius of the shadow's edge. Encoded as in VisibilityWeights, with a
// column for each light. Throws Cancelled.
VisibilityWeights lightVisibility(const SurfelCloud& cloud, const Occluders& occluders,
                                  std::span<const capture::Light> lights, const Progress& progress = {});

} // namespace surflect::ulr
