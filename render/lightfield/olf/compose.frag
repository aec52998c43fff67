#version 450 core
// A layer, under those before it.
layout(binding = 0) uniform sampler2D layer;
out vec4 result;

void main() { result = texelFetch(layer, ivec2(gl_FragCoord.xy), 0); }
