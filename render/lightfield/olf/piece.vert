#version 450 core
// Corners of pieces (bsp_tree.h), in the order of an index.

layout(std430, binding = 0) readonly buffer Pieces { uint pieces[]; }; // kPieceWords of each
layout(std430, binding = 1) readonly buffer Drawn { uint drawn[]; };   // indices of pieces
const uint kPieceWords = 16u;

uniform mat4 clipFromObject;
out vec3 pointObject; // relative to the middle of the object
out vec3 barycentric; // in the triangle
flat out uint triangle;
invariant gl_Position;

void main() {
  uint first = kPieceWords * drawn[gl_VertexID / 3], corner = first + 1u + 5u * uint(gl_VertexID % 3);
  triangle = pieces[first];
  pointObject = vec3(uintBitsToFloat(pieces[corner]), uintBitsToFloat(pieces[corner + 1u]), uintBitsToFloat(pieces[corner + 2u]));
  vec2 last = vec2(uintBitsToFloat(pieces[corner + 3u]), uintBitsToFloat(pieces[corner + 4u]));
  barycentric = vec3(1.0 - last.x - last.y, last);
  gl_Position = clipFromObject * vec4(pointObject, 1.0);
}
