// Blend of the views of a triangle at a fragment: blendAt() of reference.h, in one pass.

layout(std430, binding = 2) readonly buffer Blends { uint blends[]; }; // kBlendWords of each triangle
layout(std430, binding = 3) readonly buffer Places { vec4 places[]; }; // four of each view
layout(binding = 0) uniform sampler2DArray pictures;
const uint kBlendWords = 37u, kMostViews = 9u;

in vec3 pointObject;
in vec3 barycentric;
flat in uint triangle;

// White is 0 for views of half floats, which are premultiplied already.
vec4 premultiplied(vec4 stored, float white) {
  return white > 0.0 ? vec4(stored.a * white * stored.rgb * stored.rgb, stored.a) : stored;
}

vec4 shaded() {
  uint first = kBlendWords * triangle, count = blends[first];
  vec2 size = vec2(textureSize(pictures, 0).xy);
  vec4 sum = vec4(0.0), point = vec4(pointObject, 1.0);
  for (uint k = 0u; k < count; ++k) {
    uint at = first + 1u + k, view = blends[at];
    float weight = 0.0;
    for (uint corner = 0u; corner < 3u; ++corner)
      weight += barycentric[corner] * uintBitsToFloat(blends[at + kMostViews * (corner + 1u)]);
    // Rows of the matrix to texels, homogeneous; then the size of the part that is used.
    vec3 texel = vec3(dot(places[4u * view], point), dot(places[4u * view + 1u], point), dot(places[4u * view + 2u], point));
    if (weight == 0.0 || texel.z <= 0.0) continue;
    vec3 extent = places[4u * view + 3u].xyz; // and white
    vec2 place = clamp(texel.xy / texel.z, vec2(0.5), extent.xy - 0.5);
    sum += weight * premultiplied(textureLod(pictures, vec3(place / size, float(view)), 0.0), extent.z);
  }
  return sum;
}
