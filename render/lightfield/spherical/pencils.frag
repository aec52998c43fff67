#version 450 core
// Radiance of a ray by one pencil; the class Reference of reference.h has the plain form, reprojection.h the symbols.

const int kMostSteps = 64, kRefinements = 10;
const float kSolid = 0.5, kNoHeight = -9.0, kMargin = 1.0 / 1024.0;

in vec3 crossingScaled;
in float weight;
flat in vec4 viewerAndSlot;
flat in vec2 heightRange;
layout(location = 0) out vec4 color;        // premultiplied
layout(location = 1) out float depthTimesAlpha;

uniform float mip;
uniform float imageSize;  // texels of the largest mip level
uniform int depthCorrected;
layout(binding = 0) uniform sampler2DArray colors;
layout(binding = 1) uniform sampler2DArray heights;

float above(vec2 plane, vec2 slope, float slot, float h) {
  return textureLod(heights, vec3(plane + h * slope, slot), mip).r - h;
}

// passesSphere() of reprojection.h.
bool passesSphere(vec3 e, vec2 plane, vec2 slope) {
  vec2 offset = plane - 0.5;
  float nearest = -dot(offset, slope) / (1.0 + dot(slope, slope));
  vec2 foot = offset + nearest * slope;
  vec3 fromMiddle = e - vec3(0.5, 0.5, 0.0);
  bool isInside = dot(fromMiddle, fromMiddle) < 0.25;
  return (nearest < e.z || isInside) && dot(foot, foot) + nearest * nearest < 0.25;
}

// crossing() of reprojection.cpp; x is a height, y how far the object is above it.
float crossing(vec2 plane, vec2 slope, float slot, vec2 high, vec2 low) {
  int kept = 0;
  for (int i = 0; i < kRefinements && low.y > 0.0; ++i) {
    float h = high.x + (low.x - high.x) * high.y / (high.y - low.y), value = above(plane, slope, slot, h);
    if (value >= 0.0) {
      low = vec2(h, value);
      kept = max(kept, 0) + 1;
      if (kept > 1) high.y *= 0.5;
    } else {
      high = vec2(h, value);
      kept = min(kept, 0) - 1;
      if (kept < -1) low.y *= 0.5;
    }
  }
  return low.x;
}

// heightMet() of reprojection.h; kNoHeight if there is none.
float heightMet(vec2 plane, vec2 slope, float slot, float viewer) {
  float start = min(viewer, heightRange.y + kMargin), end = heightRange.x - kMargin;
  if (start <= end) return kNoHeight;
  float texels = (start - end) * length(slope) * imageSize * exp2(-mip);
  int steps = int(clamp(ceil(texels), 1.0, float(kMostSteps)));
  float met = kNoHeight, metAlpha = 0.0;
  vec2 high = vec2(start, min(0.0, above(plane, slope, slot, start)));
  for (int i = 1; i <= steps; ++i) {
    float h = start - (start - end) * float(i) / float(steps);
    vec2 low = vec2(h, above(plane, slope, slot, h));
    if (high.y < 0.0 && low.y >= 0.0) {
      h = crossing(plane, slope, slot, high, low);
      float alpha = textureLod(colors, vec3(plane + h * slope, slot), mip).a;
      if (alpha > metAlpha) {
        met = h;
        metAlpha = alpha;
      }
      if (alpha >= kSolid) break;
    }
    high = low;
  }
  return met;
}

void main() {
  color = vec4(0.0);
  depthTimesAlpha = 0.0;
  vec3 e = viewerAndSlot.xyz;
  vec2 plane = crossingScaled.xy / crossingScaled.z;
  vec2 slope = (e.xy - plane) / e.z;
  if (!passesSphere(e, plane, slope)) return;
  float height = depthCorrected == 1 ? heightMet(plane, slope, viewerAndSlot.w, e.z) : 0.0;
  if (height == kNoHeight) return;
  vec2 place = plane + height * slope;
  if (any(lessThan(place, vec2(0.0))) || any(greaterThan(place, vec2(1.0)))) return;
  color = max(weight, 0.0) * textureLod(colors, vec3(place, viewerAndSlot.w), mip);
  // The scale is the ray's descent, and gl_FragCoord.w the inverse of its part along the viewing axis.
  depthTimesAlpha = color.a * (e.z - height) / (crossingScaled.z * gl_FragCoord.w);
}
