// Light from all around, as a photographic studio has it.
#pragma once

#include "srf/ulr/environment.h"

namespace surflect::bench {

// A dim room, its floor darker than its ceiling, with a warm lamp on one side and a weaker, cold one on the
// other. y is up.
ulr::EnvironmentMap studioLight();

} // namespace surflect::bench
