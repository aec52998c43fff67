#version 450 core
#include "bad.glsl"
out vec4 result;

void main() { result = vec4(halved(twice(1.0))); }
