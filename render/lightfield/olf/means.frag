#version 450 core
// The mean of a square of side * side pixels of the picture, summed row by row.
layout(binding = 0) uniform sampler2D picture;
uniform int side;
out vec4 result;

void main() {
  ivec2 first = side * ivec2(gl_FragCoord.xy);
  vec4 sum = vec4(0.0);
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) sum += texelFetch(picture, first + ivec2(x, y), 0);
  result = sum / float(side * side);
}
