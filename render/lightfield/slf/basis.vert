#version 450 core
#include "basis.glsl"

// Perspective-correct interpolation of the hat gives the barycentric coordinate of the point where a pixel's ray
// meets the flat triangle.
out float hat;

void main() { hat = placeCorner(); }
