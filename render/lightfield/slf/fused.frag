#version 450 core
#include "texel.glsl"
// All passes of a region at once: the three hat functions that are not 0 at the pixel's direction, and their
// textures. [Azuma 1999, §2.2]
const int kTriangles = 48;
uniform int triangleCount;              // of the direction mesh that this draw has
uniform vec4 hatRows[3 * kTriangles];   // hat of each corner, up to a common factor: its product with r
uniform vec4 triangleSlots[kTriangles]; // of the three corners' textures; and the triangle's number, ascending
uniform int comparedTriangles;          // triangles of the whole mesh if other draws have some of them, or 0
layout(binding = kArrays) uniform sampler2D meshHatRows; // hatRows of the whole mesh: column corner, row triangle
uniform float sureHat; // hats above this, for a unit r, are in the triangle that holds r, whatever rounding does
uniform vec3 viewerCentred;
in vec2 placeTexels;
in vec3 pointCentred;
out vec4 radianceAndObserved;

vec3 hatsOf(vec4 a, vec4 b, vec4 c, vec3 r) {
  precise vec3 hats = vec3(a.x * r.x + a.y * r.y + a.z * r.z, b.x * r.x + b.y * r.y + b.z * r.z,
                           c.x * r.x + c.y * r.y + c.z * r.z);
  return hats;
}

float least(vec3 hats) { return min(min(hats.x, hats.y), hats.z); }

void main() {
  precise vec3 r = viewerCentred - pointCentred;
  float sure = sureHat * length(r);
  // The triangle that holds r has no negative hat; a comparison instead of a sign leaves no gap at edges.
  int found = 0;
  precise vec3 hats = hatsOf(hatRows[0], hatRows[1], hatRows[2], r);
  for (int t = 1; t < triangleCount && least(hats) <= sure; ++t) {
    precise vec3 h = hatsOf(hatRows[3 * t], hatRows[3 * t + 1], hatRows[3 * t + 2], r);
    if (least(h) > least(hats)) {
      hats = h;
      found = t;
    }
  }
  if (comparedTriangles > 0 && least(hats) <= sure) {
    if (least(hats) < -sure)
      discard;
    int own = int(triangleSlots[found].w);
    for (int t = 0; t < comparedTriangles; ++t) {
      precise vec3 h = hatsOf(texelFetch(meshHatRows, ivec2(0, t), 0), texelFetch(meshHatRows, ivec2(1, t), 0),
                              texelFetch(meshHatRows, ivec2(2, t), 0), r);
      if (t != own && (least(h) > least(hats) || (least(h) == least(hats) && t < own)))
        discard;
    }
  }
  vec3 positive = max(hats, 0.0);
  vec3 weights = positive / (positive.x + positive.y + positive.z);
  radianceAndObserved = weights.x * texelAt(triangleSlots[found].x, placeTexels) +
                        weights.y * texelAt(triangleSlots[found].y, placeTexels) +
                        weights.z * texelAt(triangleSlots[found].z, placeTexels);
}
