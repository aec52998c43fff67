// Findings of a capture's checks, as printed lines and as JSON.
#pragma once

#include "apps/command.h"
#include "srf/validation/validation.h"

#include <span>

namespace surflect {

// Prints each finding on a line.
void announce(std::span<const validation::Finding> findings);
Json jsonOf(std::span<const validation::Finding> findings);
size_t countErrors(std::span<const validation::Finding> findings);

} // namespace surflect
