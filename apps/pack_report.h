// Reports shared by `pack` and `capture --pack`.
#pragma once

#include "apps/command.h"
#include "srf/model/pack.h"
#include "srf/validation/validation.h"

#include <span>
#include <string>

namespace surflect {

// Findings of a capture's checks, as printed lines and as JSON.

// Prints each finding on a line.
void announce(std::span<const validation::Finding> findings);
Json jsonOf(std::span<const validation::Finding> findings);
size_t countErrors(std::span<const validation::Finding> findings);

void announceEstimate(const model::PackEstimate& estimate);
void announce(const model::PackReport& report, const std::string& output);
Json jsonOf(const model::PackReport& report);

} // namespace surflect
