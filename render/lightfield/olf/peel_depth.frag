#version 450 core
// Depths of the fragments behind the layer before; the depth test keeps the nearest.  [Vlasic 2003, A.3]
#include "depth_peeling.glsl"
layout(binding = 0) uniform sampler2D layerBefore;
layout(std430, binding = 6) buffer Counter { uint used; };

void main() {
  if (!isBehind(layerBefore)) discard;
  atomicAdd(used, 1u);
}
