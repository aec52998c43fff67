#version 450 core
// Fragments behind the layer before; the depth test keeps the nearest.
#include "shade.glsl"
#include "depth_peeling.glsl"

layout(binding = 1) uniform sampler2D layerBefore; // depths
layout(std430, binding = 6) buffer Counter { uint used; };
out vec4 result;

void main() {
  if (!isBehind(layerBefore)) discard;
  result = shaded();
  atomicAdd(used, 1u);
}
