#version 450 core
// A layer, behind those that are shown.
#include "composite.glsl"
layout(binding = 0) uniform sampler2D layer;
layout(binding = 1) uniform sampler2D shown;
out vec4 result;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  result = inFrontOf(texelFetch(shown, pixel, 0), texelFetch(layer, pixel, 0));
}
