// Corner of a triangle of the direction mesh turned around the camera, and the hat function of one direction
// there. [Azuma 1999, §2.3]
const int kCorners = 48;
uniform vec4 corners[kCorners];   // sample direction, and its number
uniform mat4 clipFromDirection;   // its depth is always the middle of the depth range
uniform float direction;          // number of the hat function's direction

float placeCorner() {
  vec4 corner = corners[gl_VertexID];
  gl_Position = clipFromDirection * vec4(-corner.xyz, 1.0);
  return corner.w == direction ? 1.0 : 0.0;
}
