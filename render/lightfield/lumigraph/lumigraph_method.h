// Lumigraphs as a method, which surface light fields are compared with.  [Azuma 1999, §4]
#pragma once

#include "render/method/method.h"

namespace surflect::lumigraph {

// Frames have the AOV "depth".
const method::Method& lumigraphMethod();

} // namespace surflect::lumigraph
