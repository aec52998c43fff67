// Captures with few gaps: pairs of a query's nearest views and lights suffice, as in a full product.
#pragma once

#include "srf/shading/reflectance_field.h"

namespace surflect::shading {

// True if at most a quarter of the pairs is missing among the kNearSources nearest views of any view and the
// nearest lights of any light, seen from the middle of the cloud. Costs about 40 look-ups for each pair of a
// capture with gaps.
bool hasNearPairs(const ReflectanceField& field);

} // namespace surflect::shading
