#version 450 core
// Fragments behind the layer before; the depth test keeps the nearest.
#include "shade.glsl"

layout(binding = 1) uniform sampler2D layerBefore; // depths
layout(std430, binding = 6) buffer Counter { uint used; };
uniform int isFirst;
out vec4 result;

void main() {
  if (isFirst == 0 && gl_FragCoord.z <= texelFetch(layerBefore, ivec2(gl_FragCoord.xy), 0).r) discard;
  result = shaded();
  atomicAdd(used, 1u);
}
