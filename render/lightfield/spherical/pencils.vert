#version 450 core
// Corners of triangles on the directional sphere around the viewer.  [Domingo 2007, §3.1]

layout(location = 0) in vec4 rayAndWeight; // from the viewer, along world axes
layout(location = 1) in vec4 rightAndSlot; // an axis of the image, along world axes; and its slot
layout(location = 2) in vec3 upwards;      // the other axis
layout(location = 3) in vec3 viewer;       // e of reprojection.h

uniform mat4 clipFromRay;

out float weight;
flat out vec4 right;
flat out vec3 up, e;

void main() {
  gl_Position = clipFromRay * vec4(rayAndWeight.xyz, 1.0);
  gl_Position.z = gl_Position.w; // directions have no depth: behind all of the surface
  weight = rayAndWeight.w;
  right = rightAndSlot;
  up = upwards;
  e = viewer;
}
