// Surface light fields as a method.  [Azuma 1999]
#pragma once

#include "render/method/method.h"

namespace surflect::slf {

// Frames have the AOVs "depth", and "observed", the share of a pixel's radiance that photographs observed.
const method::Method& slfMethod();

} // namespace surflect::slf
