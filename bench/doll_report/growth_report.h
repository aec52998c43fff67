// How the cost of a frame grows, as JSON and as tables.
#pragma once

#include "bench/doll/growth.h"
#include "bench/doll/machine.h"

#include <string>

namespace surflect {

// An object of "rows", "sweeps" and "look_ups".
std::string growthJson(const Growth& growth, const MachineLimits& machine);

// The same as tables and verdicts.
std::string growthText(const Growth& growth, const MachineLimits& machine);

} // namespace surflect
