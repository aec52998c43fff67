#version 450 core
// A fragment of blended views, for the list of its pixel.
#include "shade.glsl"
#include "per_pixel_lists.glsl"

void main() { append(shaded(), triangle); }
