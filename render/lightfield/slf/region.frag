#version 450 core
// Region stage of a pass: the texture, which blending multiplies by that alpha.  [Azuma 1999, §2.3]
#include "texel.glsl"
uniform float slot;
in vec2 placeTexels;
layout(location = 0) out vec4 radiance;
layout(location = 1) out vec4 observed;

void main() {
  vec4 texel = texelAt(slot, placeTexels);
  radiance = vec4(texel.rgb, 0.0);
  observed = vec4(texel.aaa, 0.0);
}
