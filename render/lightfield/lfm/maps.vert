#version 450 core
#include "position.glsl"
// Frames of the three corners of the vertex's triangle.
layout(location = 1) in vec3 cornerX[3]; // acquisition space
layout(location = 4) in vec3 cornerY[3];
uniform vec3 viewerCentred;
out vec2 barycentrics; // of corners 1 and 2
out vec3 towards[3];   // to the viewer, in the frames of the corners
flat out int triangle;

void main() {
  place();
  int corner = gl_VertexID % 3;
  triangle = gl_VertexID / 3;
  barycentrics = vec2(corner == 1, corner == 2);
  vec3 viewer = viewerCentred - positionCentred;
  for (int i = 0; i < 3; ++i)
    towards[i] = vec3(dot(cornerX[i], viewer), dot(cornerY[i], viewer),
                      dot(cross(cornerX[i], cornerY[i]), viewer));
}
