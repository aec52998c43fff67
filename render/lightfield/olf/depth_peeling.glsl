// Whether the next layer of depth peeling may hold a fragment: it is behind the layer before, and in front of the far
// plane. The depth of a triangle seen edge-on may be any number, or none at all.
uniform int isFirst;

bool isBehind(sampler2D layerBefore) { // depths
  float z = gl_FragCoord.z;
  return z < 1.0 && (isFirst == 1 || z > texelFetch(layerBefore, ivec2(gl_FragCoord.xy), 0).r);
}
