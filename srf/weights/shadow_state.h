// Shadow state of a surfel under a light: the part of the light that reaches it. A lit surfel is shown by
// photographs in which it is lit, a surfel in shadow by photographs in which it is in shadow, so that a
// shadow has one edge instead of that of every blended light. Not in the papers.
#pragma once

#include "srf/capture/rig.h"
#include "srf/weights/visibility_weights.h"
#include "surfel/occluders.h"

namespace surflect::weights {

// Shadow states of all surfels: the part of the element around each surfel that each light reaches, 0..1. It
// is 1 in light, 0 in a cast or attached shadow, and in between within visibilityRadius of the shadow's edge.
// Encoded as in VisibilityWeights, with a column for each light. Throws Cancelled.
VisibilityWeights shadowStates(const SurfelCloud& cloud, const Occluders& occluders,
                               std::span<const capture::Light> lights, const Progress& progress = {});

} // namespace surflect::weights
