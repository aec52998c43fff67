// Spherical light fields as a method.  [Domingo 2007]
#pragma once

#include "render/lightfield/spherical/build.h"
#include "render/method/method.h"

namespace surflect::spherical {

// Frames have the AOV "depth". Renderer::keepBudget() chooses levels of detail by predicted times
// [Domingo 2007, §4.2]; images that are not at hand are then shown by their ancestors'.
const method::Method& sphericalMethod();

// Options of a build that a stage file, which is traced, can have; and the report of such a build.
BuildOptions buildOptionsOf(const method::Setting& setting);
method::BuildReport reportOf(const BuildReport& report, const method::BuildInput& input, double seconds);

} // namespace surflect::spherical
