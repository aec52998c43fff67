#version 450 core
// Corners of triangles on the directional sphere around the viewer, with the rays through them cast to the
// image planes.  [Domingo 2007, §3.1]

layout(location = 0) in vec3 ray;      // from the viewer, along world axes
layout(location = 1) in vec4 crossing; // x(0) (reprojection.h) times a scale, and the scale; weight
layout(location = 2) in vec4 viewer;   // e, and the slot of the image
layout(location = 3) in vec2 range;    // least and greatest height of the image

uniform mat4 clipFromRay;

out vec3 crossingScaled;
out float weight;
flat out vec4 viewerAndSlot;
flat out vec2 heightRange;

void main() {
  gl_Position = clipFromRay * vec4(ray, 1.0);
  gl_Position.z = 0.5 * gl_Position.w; // directions have no depth
  crossingScaled = crossing.xyz;
  weight = crossing.w;
  viewerAndSlot = viewer;
  heightRange = range;
}
