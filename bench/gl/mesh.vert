#version 450 core
layout(location = 0) in vec3 positionObject;
uniform mat4 clipFromObject;
invariant gl_Position;
out vec2 place;

void main() {
  gl_Position = clipFromObject * vec4(positionObject, 1.0);
  place = 0.5 + 0.5 * positionObject.xy;
}
