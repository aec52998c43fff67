#version 450 core
// A layer of roots, behind those that are shown.
#include "composite.glsl"
#include "roots.glsl"
layout(binding = 0) uniform sampler2D layer;
layout(binding = 1) uniform sampler2D shown;
out vec4 result;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  result = inFrontOf(texelFetch(shown, pixel, 0), colorOf(texelFetch(layer, pixel, 0)));
}
