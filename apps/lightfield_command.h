// Parts of `surflect lightfield`.
#pragma once

#include "apps/command.h"

namespace surflect {

void addLightFieldBuild(CLI::App& lightField, CommandWork& work);
void addLightFieldScene(CLI::App& lightField, CommandWork& work);
void addLightFieldCompare(CLI::App& lightField, CommandWork& work);
void addLightFieldBenchmark(CLI::App& lightField, CommandWork& work);
void addLightFieldFly(CLI::App& lightField, CommandWork& work);

} // namespace surflect
