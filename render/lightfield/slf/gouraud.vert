#version 450 core
#include "basis.glsl"

// The quotient of its parts is linear on the screen, as the paper's Gouraud shading. Where a triangle reaches behind the
// camera such an interpolation would leave 0..1: it is perspective there.
out vec2 scaledHat;

void main() {
  float hat = placeCorner();
  int first = gl_VertexID - gl_VertexID % 3;
  bool isInFront = true;
  for (int i = first; i < first + 3; ++i)
    isInFront = isInFront && (clipFromDirection * vec4(-corners[i].xyz, 1.0)).w > 0.0;
  scaledHat = (isInFront ? gl_Position.w : 1.0) * vec2(hat, 1.0);
}
