#version 450 core
// Fragments that come back to front.
#include "shade.glsl"
out vec4 result;

void main() { result = shaded(); }
