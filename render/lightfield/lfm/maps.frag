#version 450 core
// A part of the sum of light field maps, times a factor.
#include "maps.glsl"
uniform float factor;
uniform bool cutsNegative; // whether negative sums are 0
out vec4 root;

void main() {
  vec4 sum = factor * rootSum();
  root = cutsNegative ? max(sum, 0.0) : sum;
}
