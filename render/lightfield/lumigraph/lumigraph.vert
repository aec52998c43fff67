#version 450 core
#include "position.glsl"
out vec3 pointObject;

void main() {
  place();
  pointObject = positionObject;
}
