#version 450 core
#include "position.glsl"

void main() { place(); }
