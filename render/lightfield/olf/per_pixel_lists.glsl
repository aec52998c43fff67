// Appends fragments to the linked list of their pixel; PerPixelLists composites them.

layout(std430, binding = 4) buffer Heads { uint heads[]; }; // of each pixel: a node's number + 1, or 0
layout(std430, binding = 5) writeonly buffer Nodes { uint nodes[]; };
layout(std430, binding = 6) buffer Counter { uint used; };
const uint kNodeWords = 5u;

uniform int width;
uniform int capacity; // nodes

void append(vec4 color, uint triangle) {
  if (color == vec4(0.0)) return;
  uint node = atomicAdd(used, 1u);
  if (node >= uint(capacity)) return;
  uint pixel = uint(gl_FragCoord.y) * uint(width) + uint(gl_FragCoord.x);
  uint at = kNodeWords * node;
  nodes[at] = atomicExchange(heads[pixel], node + 1u);
  nodes[at + 1u] = floatBitsToUint(gl_FragCoord.z);
  nodes[at + 2u] = triangle;
  nodes[at + 3u] = packHalf2x16(min(color.rg, vec2(65504.0)));
  nodes[at + 4u] = packHalf2x16(min(color.ba, vec2(65504.0)));
}
