#version 450 core
// Radiance of a point of the geometry towards the viewer: radianceAt() of reconstruction.h.

const int kSlabs = 6;

in vec3 pointObject;
out vec4 result; // premultiplied

uniform vec3 viewerObject;
uniform int nodes; // along each side of an st grid
uniform float weightSlope; // of slabWeights() in slab.h; 0: the slabs do not overlap
uniform float filledWeight;
uniform int exactOutline; // 1: alpha is 1
// Planes and grids of the slabs (slab.h), relative to the middle of the object.
uniform float stPlane[kSlabs], uvPlane[kSlabs];
uniform vec2 stLow[kSlabs], stSpacing[kSlabs], uvLow[kSlabs], uvSize[kSlabs];
layout(binding = 0) uniform sampler2DArray pictures[kSlabs]; // layer i + j * nodes is node (i, j)

struct Sum {
  vec3 color;    // of colours times their weights
  float weights; // of colours
  float alpha;   // of alphas times the weights of their nodes
};

void addNode(sampler2DArray pictureOf, int k, ivec2 node, vec2 point, float towardsUv, float weight, inout Sum sum) {
  vec2 place = stLow[k] + vec2(node) * stSpacing[k];
  vec2 uv = (mix(point, place, towardsUv) - uvLow[k]) / uvSize[k];
  vec4 texel = textureLod(pictureOf, vec3(uv, node.x + node.y * nodes), 0.0);
  float colorWeight = weight * (texel.a + filledWeight);
  sum.color += colorWeight * texel.rgb;
  sum.weights += colorWeight;
  sum.alpha += weight * texel.a;
}

// Adds slab k. Components of the vectors are those along the axes of u, v and the normal.
void addSlab(sampler2DArray pictureOf, int k, float weight, vec3 point, vec3 towards, inout Sum sum) {
  vec2 crossing = point.xy + (stPlane[k] - point.z) / towards.z * towards.xy;
  vec2 st = clamp((crossing - stLow[k]) / stSpacing[k], 0.0, float(nodes - 1));
  ivec2 first = min(ivec2(st), nodes - 1), second = min(first + 1, nodes - 1);
  vec2 share = st - vec2(first);
  float towardsUv = (uvPlane[k] - point.z) / (stPlane[k] - point.z);
  addNode(pictureOf, k, first, point.xy, towardsUv, weight * (1.0 - share.x) * (1.0 - share.y), sum);
  addNode(pictureOf, k, ivec2(second.x, first.y), point.xy, towardsUv, weight * share.x * (1.0 - share.y), sum);
  addNode(pictureOf, k, ivec2(first.x, second.y), point.xy, towardsUv, weight * (1.0 - share.x) * share.y, sum);
  addNode(pictureOf, k, second, point.xy, towardsUv, weight * share.x * share.y, sum);
}

// Weights of the slabs of the three axes.
vec3 axisWeights(vec3 towards) {
  vec3 size = abs(towards);
  float largest = max(size.x, max(size.y, size.z));
  if (weightSlope == 0.0)
    return size.x == largest ? vec3(1, 0, 0) : size.y == largest ? vec3(0, 1, 0) : vec3(0, 0, 1);
  vec3 weights = max(1.0 - (largest - size) / largest * weightSlope, 0.0);
  return weights / (weights.x + weights.y + weights.z);
}

void main() {
  vec3 p = pointObject, towards = viewerObject - p;
  result = vec4(0.0);
  if (towards == vec3(0.0)) return;
  vec3 weights = axisWeights(towards);
  Sum sum = Sum(vec3(0.0), 0.0, 0.0);
  // The axes of u and v are those after the normal's; in the other order on the negative side.
  if (weights.x > 0.0) {
    if (towards.x > 0.0)
      addSlab(pictures[0], 0, weights.x, p.yzx, towards.yzx, sum);
    else
      addSlab(pictures[1], 1, weights.x, p.zyx, towards.zyx, sum);
  }
  if (weights.y > 0.0) {
    if (towards.y > 0.0)
      addSlab(pictures[2], 2, weights.y, p.zxy, towards.zxy, sum);
    else
      addSlab(pictures[3], 3, weights.y, p.xzy, towards.xzy, sum);
  }
  if (weights.z > 0.0) {
    if (towards.z > 0.0)
      addSlab(pictures[4], 4, weights.z, p.xyz, towards.xyz, sum);
    else
      addSlab(pictures[5], 5, weights.z, p.yxz, towards.yxz, sum);
  }
  if (sum.weights <= 0.0) return;
  float alpha = exactOutline == 1 ? 1.0 : sum.alpha;
  result = vec4(alpha / sum.weights * sum.color, alpha);
}
