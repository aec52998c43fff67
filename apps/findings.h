// Findings of the checks of a capture, as commands print them and as JSON.
#pragma once

#include "apps/command.h"
#include "srf/validation/validation.h"

#include <span>

namespace surflect {

// Says each finding in a line.
void announce(std::span<const validation::Finding> findings);
Json jsonOf(std::span<const validation::Finding> findings);
size_t countErrors(std::span<const validation::Finding> findings);

} // namespace surflect
