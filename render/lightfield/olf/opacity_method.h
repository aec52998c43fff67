// Opacity light fields as methods: views blended by view-dependent texture mapping or by unstructured
// lumigraph rendering, and light field maps of them.  [Vlasic 2003]
#pragma once

#include "render/method/method.h"

namespace surflect::olf {

const method::Method& vdtmMethod(); // [Vlasic 2003, §4]
const method::Method& ulrMethod();  // [Vlasic 2003, §5]
const method::Method& olfmMethod(); // [Vlasic 2003, §6]

} // namespace surflect::olf
