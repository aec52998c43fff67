// Reports shared by `pack` and `capture --pack`.
#pragma once

#include "apps/command.h"
#include "srf/model/pack.h"

#include <string>

namespace surflect {

void announceEstimate(const model::PackEstimate& estimate);
void announce(const model::PackReport& report, const std::string& output);
Json jsonOf(const model::PackReport& report);

} // namespace surflect
