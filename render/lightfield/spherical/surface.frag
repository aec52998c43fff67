#version 450 core
// Point where the ray of a pixel meets the plane of the triangle that covers the pixel. The rasteriser's own depth
// would belong to corners that it has moved to 1/256 of a pixel.
//
// Here and in pencils.frag, the unit of length is the diameter of the object's sphere, and its middle the origin.

flat in float triangle;
layout(location = 0) out vec4 pointAndDistance; // distance along the viewing axis, metres; 0 beside the object

uniform vec3 viewer;
uniform mat3 rayOfPixel; // from column, row and 1 to the ray that goes one metre along the viewing axis
uniform vec3 axis;       // viewing axis, as long as the sphere's diameter in metres
layout(binding = 0) uniform sampler2D corners; // three texels for each triangle

vec3 cornerFromViewer(int number) {
  int row = textureSize(corners, 0).x;
  return texelFetch(corners, ivec2(number % row, number / row), 0).xyz - viewer;
}

void main() {
  int first = 3 * int(triangle);
  vec3 a = cornerFromViewer(first), b = cornerFromViewer(first + 1), c = cornerFromViewer(first + 2);
  vec3 ray = rayOfPixel * vec3(gl_FragCoord.xy, 1.0);
  vec3 normal = cross(b - a, c - a), depths = vec3(dot(axis, a), dot(axis, b), dot(axis, c));
  float distance = dot(normal, a) / dot(normal, ray);
  // Beside an edge, a plane that is nearly seen edge-on may be met anywhere.
  float nearest = max(0.0, min(min(depths.x, depths.y), depths.z)), farthest = max(max(depths.x, depths.y), depths.z);
  if (!(distance > nearest && distance < farthest)) distance = 1.0 / gl_FragCoord.w;
  pointAndDistance = vec4(viewer + distance * ray, distance);
}
