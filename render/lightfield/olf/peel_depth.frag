#version 450 core
// Depths of the fragments behind the layer before; the depth test keeps the nearest.  [Vlasic et al. 2003, A.3]
layout(binding = 0) uniform sampler2D layerBefore;
layout(std430, binding = 6) buffer Counter { uint used; };
uniform int isFirst;

void main() {
  if (isFirst == 0 && gl_FragCoord.z <= texelFetch(layerBefore, ivec2(gl_FragCoord.xy), 0).r) discard;
  atomicAdd(used, 1u);
}
