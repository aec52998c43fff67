#version 450 core
// Radiance of a ray by one pencil; reference.cpp has the plain form, reprojection.h the symbols. Lengths are in
// diameters of the object's sphere, as in surface.frag.

const float kTolerance = 2.0, kHidden = 1.0 / 1024.0;

in float weight;
flat in vec4 right; // axis of the image, and its slot
flat in vec3 up, e;
layout(location = 0) out vec4 color;    // premultiplied
layout(location = 1) out float weightOrDepth; // the weight; where the plane is shown, depth times alpha

uniform mat3 rayOfPixel; // as in surface.frag
uniform float mip;
uniform float texel; // side of a texel of the mip level
uniform int depthCorrected;
layout(binding = 0) uniform sampler2DArray colors;
layout(binding = 1) uniform sampler2DArray heights;
layout(binding = 2) uniform sampler2D surface; // as surface.frag draws it

// vectorOf() of pencil_image.h.
vec3 vectorOf(vec3 direction) {
  return vec3(dot(right.xyz, direction), -dot(up, direction), dot(cross(right.xyz, up), direction));
}

// visibility() of reprojection.h.
float visibility(vec3 place) {
  float inFront = textureLod(heights, vec3(place.xy, right.w), mip).r - place.z;
  return clamp(2.0 - inFront / (kTolerance * texel), 0.0, 1.0);
}

// weightOfAlpha() of reprojection.h.
float weightOfAlpha(float alpha) {
  float solid = clamp(2.0 * alpha - 1.0, 0.0, 1.0);
  return solid * solid;
}

// The point of the surface, which all pencils show.
void showPoint() {
  vec4 pointAndDistance = texelFetch(surface, ivec2(gl_FragCoord.xy), 0);
  if (pointAndDistance.w == 0.0) return;
  vec3 place = vectorOf(pointAndDistance.xyz) + vec3(0.5, 0.5, 0.0);
  vec4 shown = textureLod(colors, vec3(place.xy, right.w), mip);
  weightOrDepth = max(weight, 0.0) * max(kHidden, visibility(place) * weightOfAlpha(shown.a));
  color = weightOrDepth * shown;
}

// passesSphere() of reprojection.h.
bool passesSphere(vec2 plane, vec2 slope) {
  vec2 offset = plane - 0.5;
  float nearest = -dot(offset, slope) / (1.0 + dot(slope, slope));
  vec2 foot = offset + nearest * slope;
  vec3 fromMiddle = e - vec3(0.5, 0.5, 0.0);
  bool isInside = dot(fromMiddle, fromMiddle) < 0.25;
  return (nearest < e.z || isInside) && dot(foot, foot) + nearest * nearest < 0.25;
}

// Where the ray meets the image's plane.
void showPlane() {
  vec3 w = vectorOf(rayOfPixel * vec3(gl_FragCoord.xy, 1.0));
  float distance = -e.z / w.z; // along the viewing axis
  vec2 plane = e.xy + distance * w.xy;
  if (!passesSphere(plane, w.xy / w.z)) return;
  if (any(lessThan(plane, vec2(0.0))) || any(greaterThan(plane, vec2(1.0)))) return;
  color = max(weight, 0.0) * textureLod(colors, vec3(plane, right.w), mip);
  weightOrDepth = color.a * distance;
}

void main() {
  color = vec4(0.0);
  weightOrDepth = 0.0;
  if (depthCorrected == 1)
    showPoint();
  else
    showPlane();
}
