#version 450 core
out vec4 result;

void main() {
  result = undeclared;
}
