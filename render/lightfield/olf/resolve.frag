#version 450 core
// Composites the linked list of a pixel, nearest first. Fragments at one depth are in the order of their triangles.

layout(std430, binding = 4) readonly buffer Heads { uint heads[]; };
layout(std430, binding = 5) readonly buffer Nodes { uint nodes[]; };
const uint kNodeWords = 5u;
const int kMost = 32; // the nearest fragments count

uniform int width;
out vec4 result;

bool isBefore(uint a, uint b) {
  float depthA = uintBitsToFloat(nodes[kNodeWords * a + 1u]), depthB = uintBitsToFloat(nodes[kNodeWords * b + 1u]);
  return depthA < depthB || (depthA == depthB && nodes[kNodeWords * a + 2u] < nodes[kNodeWords * b + 2u]);
}

void main() {
  uint sorted[kMost];
  int count = 0;
  for (uint next = heads[uint(gl_FragCoord.y) * uint(width) + uint(gl_FragCoord.x)]; next != 0u;) {
    uint node = next - 1u;
    next = nodes[kNodeWords * node];
    if (count == kMost && !isBefore(node, sorted[kMost - 1])) continue;
    int at = count < kMost ? count++ : kMost - 1;
    for (; at > 0 && isBefore(node, sorted[at - 1]); --at) sorted[at] = sorted[at - 1];
    sorted[at] = node;
  }
  vec4 sum = vec4(0.0);
  for (int i = 0; i < count; ++i) {
    uint at = kNodeWords * sorted[i] + 3u;
    sum += (1.0 - sum.a) * vec4(unpackHalf2x16(nodes[at]), unpackHalf2x16(nodes[at + 1u]));
  }
  result = sum;
}
