#version 450 core
// Roots of a part of light field maps, where the depth test finds the layer.
#include "maps.glsl"
out vec4 root;

void main() { root = rootSum(); }
