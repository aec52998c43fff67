layout(location = 0) in vec3 positionObject; // relative to the middle of the object
layout(location = 1) in float fringe;        // 1 for vertices of the fringe, 0 for the geometry's
uniform mat4 clipFromObject;
invariant gl_Position;

// Depths of the geometry are in 0..1/2, and so in front of the fringe's.
void place() {
  gl_Position = clipFromObject * vec4(positionObject, 1.0);
  gl_Position.z = 0.5 * (gl_Position.z + fringe * gl_Position.w);
}
