#version 450 core
// A fragment of light field maps, for the list of its pixel.
#include "maps.glsl"
#include "roots.glsl"
#include "per_pixel_lists.glsl"

void main() { append(colorOf(rootSum()), uint(triangle)); }
