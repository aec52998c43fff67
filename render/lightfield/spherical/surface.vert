#version 450 core
// The object's surface as the viewer sees it.

layout(location = 0) in vec4 positionAndTriangle; // number of the triangle whose last corner the vertex is
uniform mat4 clipFromWorld;
flat out float triangle;

void main() {
  gl_Position = clipFromWorld * vec4(positionAndTriangle.xyz, 1.0);
  triangle = positionAndTriangle.w;
}
