#version 450 core
// A layer of roots, under those before it.
#include "roots.glsl"
layout(binding = 0) uniform sampler2D layer;
out vec4 result;

void main() { result = colorOf(texelFetch(layer, ivec2(gl_FragCoord.xy), 0)); }
