#version 450 core
#include "basis.glsl"

// The quotient of its parts is linear on the screen, as the paper's Gouraud shading; an interpolation without
// perspective would not be defined where triangles reach behind the camera.
out vec2 scaledHat;

void main() {
  float hat = placeCorner();
  scaledHat = gl_Position.w * vec2(hat, 1.0);
}
