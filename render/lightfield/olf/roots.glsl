// Radiance times opacity, and opacity, of their roots (opacity_maps.h).
uniform float white;

vec4 colorOf(vec4 root) {
  vec4 positive = max(root, 0.0);
  return vec4(white * positive.rgb * positive.rgb, min(positive.a * positive.a, 1.0));
}
