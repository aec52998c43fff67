#version 450 core
// Composites the linked list of a pixel, nearest first. Fragments at one depth are in the order of their triangles.
// Each step looks for the next fragment in the whole list, which is short: so it needs no array, and no limit.
#include "composite.glsl"

layout(std430, binding = 4) readonly buffer Heads { uint heads[]; };
layout(std430, binding = 5) readonly buffer Nodes { uint nodes[]; };
const uint kNodeWords = 5u;

uniform int width;
out vec4 result;

bool isBefore(uint depthA, uint triangleA, uint depthB, uint triangleB) {
  return depthA < depthB || (depthA == depthB && triangleA < triangleB);
}

void main() {
  uint head = heads[uint(gl_FragCoord.y) * uint(width) + uint(gl_FragCoord.x)];
  vec4 sum = vec4(0.0);
  // Depths are not negative, so their bits are in the order of their values. Triangles count from 1.
  uint lastDepth = 0u, lastTriangle = 0u;
  while (true) {
    uint best = 0u, bestDepth = 0xffffffffu, bestTriangle = 0xffffffffu;
    for (uint next = head; next != 0u;) {
      uint at = kNodeWords * (next - 1u), depth = nodes[at + 1u], triangle = nodes[at + 2u] + 1u;
      if (isBefore(lastDepth, lastTriangle, depth, triangle) && isBefore(depth, triangle, bestDepth, bestTriangle)) {
        best = next;
        bestDepth = depth;
        bestTriangle = triangle;
      }
      next = nodes[at];
    }
    if (best == 0u) break;
    uint at = kNodeWords * (best - 1u) + 3u;
    sum = inFrontOf(sum, vec4(unpackHalf2x16(nodes[at]), unpackHalf2x16(nodes[at + 1u])));
    lastDepth = bestDepth;
    lastTriangle = bestTriangle;
  }
  result = sum;
}
