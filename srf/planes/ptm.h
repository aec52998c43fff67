// Polynomial texture maps of a stack, in the file format that RTI viewers read.
//
// [Malzbender 2001] T. Malzbender, D. Gelb, H. Wolters: Polynomial Texture Maps, SIGGRAPH.
// [PTM 1.2] T. Malzbender, D. Gelb: Polynomial Texture Map (.ptm) File Format, HP Laboratories, 2001.
//
//   v_c(lu, lv) = C_c L(lu, lv)                                      [Malzbender 2001, Eq. 5]
//   L = a0 lu^2 + a1 lv^2 + a2 lu lv + a3 lu + a4 lv + a5            [Malzbender 2001, Eq. 2]
//
// Symbols: v_c value of channel c as a screen takes it, C its colour, lu and lv the light's direction to the
// right and up.
#pragma once

#include "srf/planes/stack.h"
#include "surfel/base/time.h"

#include <string>

namespace surflect::planes {

// Bytes of a file of the format LRGB. Reads each photograph once; values are sRGB of radiance divided by
// white. Holds nine floats a pixel.
std::string lrgbPtm(const Stack& stack, float white, const Progress& progress);

} // namespace surflect::planes
