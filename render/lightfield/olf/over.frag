#version 450 core
// Fragments that come back to front.
#include "shade.glsl"
out vec4 result;

void main() {
  result = shaded();
  result.a = clamp(result.a, 0.0, 1.0); // weights may be extrapolated at an edge
}
