#version 450 core
#include "position.glsl"
layout(location = 1) in vec2 vertexTexels;
out vec2 placeTexels;
out vec3 pointCentred;

void main() {
  place();
  placeTexels = vertexTexels;
  pointCentred = positionCentred;
}
