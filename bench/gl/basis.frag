#version 450 core
uniform float weight;
out vec4 result;

void main() { result = vec4(weight); }
