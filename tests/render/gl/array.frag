#version 450 core
uniform float terms[3];
out vec4 result;

void main() { result = vec4(terms[0] + terms[1] * terms[2]); }
