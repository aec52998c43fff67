// Sum of the mean and a range of approximation terms of light field maps: square roots of radiance, and of
// opacity in maps of four channels.
// [Chen 2002, Eqs. 3, 6 and 7]
layout(binding = 0) uniform sampler2DArray surfaceMaps;
layout(binding = 1) uniform sampler2DArray viewMaps;
layout(binding = 2) uniform sampler2DArray meanMaps;
layout(binding = 3) uniform sampler2D places; // see MapTextures::places()
layout(binding = 4) uniform sampler2DArray surfaceEdges; // see MapTextures::surfaceEdges()
layout(binding = 5) uniform sampler2DArray meanEdges;
const int kPlacesWidth = 2048;
const float kFadeSteps = 3.0; // see edge_corrections.h
uniform int samples;           // along an edge of a triangle
uniform float viewSize, higherViewSize; // cells along a side of a view map of the first term; of others
uniform bool isPacked;         // one surface map for all three corners
uniform vec2 surfaceValue, viewValue; // value = max(x texel + y, -1)
uniform float meanWhite;
// Corners whose edges have corrections: 3, or 0 where maps agree. A loop over 0 corners costs nothing on Mesa, where a
// branch evaluates both sides.
uniform int surfaceEdgeCorners, meanEdgeCorners;
uniform float surfaceEdgeUnit, meanEdgeUnit; // value of a correction of 1
uniform int termCount;         // of the model: texels of a triangle in `places`
uniform bool withMean;
uniform int firstTerm, endTerm;
in vec2 barycentrics;
in vec3 towards[3];
flat in int triangle;

// Linear interpolation between three neighbouring samples of a triangle; blendAt() in patch_blend.h.
struct PatchBlend {
  ivec2 a, b, c; // samples (i, j)
  vec3 weights;
};

PatchBlend blendAt(vec2 place) {
  int last = samples - 1;
  float u = clamp(place.x, 0.0, 1.0) * last;
  float v = clamp(place.y * last, 0.0, last - u);
  int i = min(int(u), last - 1), j = min(int(v), last - 1 - i);
  float x = u - i, y = v - j;
  if (x + y <= 1.0 || i + j == last - 1)
    return PatchBlend(ivec2(i, j), ivec2(i + 1, j), ivec2(i, j + 1), vec3(1.0 - x - y, x, y));
  return PatchBlend(ivec2(i + 1, j + 1), ivec2(i, j + 1), ivec2(i + 1, j), vec3(x + y - 1.0, 1.0 - x, 1.0 - y));
}

// Sample of a triangle whose corners start at another one; turned() in patch_blend.h.
ivec2 turned(ivec2 s, int firstCorner) {
  int rest = samples - 1 - s.x - s.y;
  return firstCorner == 0 ? s : firstCorner == 1 ? ivec2(s.y, rest) : ivec2(rest, s.x);
}

vec4 placeAt(int n) { return texelFetch(places, ivec2(n % kPlacesWidth, n / kPlacesWidth), 0); }

// Surface map that has all corners, or a mean.
vec4 patchAt(sampler2DArray maps, vec4 place, PatchBlend blend, vec2 value) {
  if (place.w == 0.0) return vec4(0.0); // no map
  ivec3 origin = ivec3(place.xyz);
  int step = place.w > 0.0 ? 1 : -1;
  vec4 a = texelFetch(maps, origin + ivec3(step * blend.a, 0), 0);
  vec4 b = texelFetch(maps, origin + ivec3(step * blend.b, 0), 0);
  vec4 c = texelFetch(maps, origin + ivec3(step * blend.c, 0), 0);
  return blend.weights.x * max(value.x * a + value.y, -1.0) +
         blend.weights.y * max(value.x * b + value.y, -1.0) +
         blend.weights.z * max(value.x * c + value.y, -1.0);
}

// Surface map of one channel, of a corner.
float cornerAt(vec4 place, PatchBlend blend, int corner) {
  PatchBlend own = PatchBlend(turned(blend.a, corner), turned(blend.b, corner), turned(blend.c, corner),
                              blend.weights);
  vec4 values = patchAt(surfaceMaps, place, own, surfaceValue);
  float channel = abs(place.w);
  return channel < 1.5 ? values.r : channel < 2.5 ? values.g : values.b;
}

// Corrections on edges; the equations are those of edge_corrections.h.

vec4 edgeTexel(sampler2DArray edges, int n) {
  ivec2 size = textureSize(edges, 0).xy;
  return texelFetch(edges, ivec3(n % size.x, n / size.x % size.y, n / (size.x * size.y)), 0);
}

// Corrections at a distance 0..1 from the corner of a row.
vec4 edgeAt(sampler2DArray edges, int row, float distance) {
  float place = clamp(distance, 0.0, 1.0) * (samples - 1);
  int low = min(int(place), samples - 2), first = row * samples + low;
  return mix(edgeTexel(edges, first), edgeTexel(edges, first + 1), place - low);
}

vec3 fade(vec3 hats) { return max(1.0 - hats * (samples - 1) / kFadeSteps, 0.0); }

float surfaceCorrection(vec3 hats, int term, int corner) {
  int next = (corner + 1) % 3, before = (corner + 2) % 3;
  float rest = hats[next] + hats[before];
  vec2 share = rest > 0.0 ? vec2(hats[next], hats[before]) / rest : vec2(0.5);
  vec3 fades = fade(hats);
  vec2 weights = share * vec2(fades[before], fades[next]);
  int row = (triangle * termCount + term) * 3 + corner;
  return weights == vec2(0.0) ? 0.0 : surfaceEdgeUnit * dot(weights, edgeAt(surfaceEdges, row, 1.0 - hats[corner]).rg);
}

vec4 meanCorrection(vec3 hats) {
  vec4 sum = vec4(0.0);
  float weights = 0.0;
  vec3 fades = fade(hats);
  for (int i = 0; i < meanEdgeCorners; ++i) {
    int next = (i + 1) % 3, row = 3 * triangle + i;
    if (hats[i] >= 1.0) return meanEdgeUnit * edgeAt(meanEdges, row, 0.0);
    float weight = hats[i] * hats[next], faded = weight * fades[(i + 2) % 3];
    weights += weight;
    if (faded > 0.0) sum += faded * edgeAt(meanEdges, row, hats[next] / (hats[i] + hats[next]));
  }
  return weights > 0.0 ? meanEdgeUnit / weights * sum : vec4(0.0);
}

// Bilinear interpolation between cells of a view map.
struct ViewBlend {
  ivec2 low;    // cell
  vec2 weights; // of the next ones
};

// Cells around a direction in the frame of a vertex; constant beyond the outermost centres. [Eq. 7]
ViewBlend viewBlend(vec3 d, float size) {
  vec2 xy = d.xy / max(d.z < 0.0 ? length(d.xy) : length(d), 1e-30);
  vec2 place = clamp((xy + 1.0) * (0.5 * size) - 0.5, 0.0, size - 1.0);
  ivec2 low = min(ivec2(place), int(size) - 2);
  return ViewBlend(low, place - vec2(low));
}

vec4 cellAt(ivec3 place) { return max(viewValue.x * texelFetch(viewMaps, place, 0) + viewValue.y, -1.0); }

vec4 viewAt(vec4 place, ViewBlend blend) {
  if (place.w == 0.0) return vec4(0.0); // no map
  ivec3 low = ivec3(place.xyz) + ivec3(blend.low, 0);
  vec4 lower = mix(cellAt(low), cellAt(low + ivec3(1, 0, 0)), blend.weights.x);
  vec4 upper = mix(cellAt(low + ivec3(0, 1, 0)), cellAt(low + ivec3(1, 1, 0)), blend.weights.x);
  return place.w * mix(lower, upper, blend.weights.y);
}

vec4 rootSum() {
  PatchBlend blend = blendAt(barycentrics);
  ViewBlend views[3];
  int texelsOfTerm = isPacked ? 4 : 6;
  int first = triangle * (1 + termCount * texelsOfTerm);
  vec4 sum = vec4(0.0);
  vec3 hats = vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics), inside = max(hats, 0.0);
  if (withMean) {
    sum = meanWhite * (patchAt(meanMaps, placeAt(first), blend, vec2(1.0, 0.0)) + meanCorrection(inside));
  }
  for (int k = firstTerm; k < endTerm; ++k) {
    if (k < 2 || k == firstTerm)
      for (int corner = 0; corner < 3; ++corner)
        views[corner] = viewBlend(towards[corner], k == 0 ? viewSize : higherViewSize);
    int n = first + 1 + k * texelsOfTerm;
    vec3 surface;
    if (isPacked) {
      surface = patchAt(surfaceMaps, placeAt(n), blend, surfaceValue).rgb;
      n += 1;
    } else {
      surface = vec3(cornerAt(placeAt(n), blend, 0), cornerAt(placeAt(n + 1), blend, 1),
                     cornerAt(placeAt(n + 2), blend, 2));
      n += 3;
    }
    for (int corner = 0; corner < surfaceEdgeCorners; ++corner) surface[corner] += surfaceCorrection(inside, k, corner);
    surface *= hats;
    for (int corner = 0; corner < 3; ++corner) sum += surface[corner] * viewAt(placeAt(n + corner), views[corner]);
  }
  return sum;
}
