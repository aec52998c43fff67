// Position of a vertex of the mesh, by one expression for the depth prepass and all passes, which draw where
// depths are equal.
layout(location = 0) in vec3 positionCentred; // acquisition space, relative to the middle of the mesh
uniform mat4 clipFromCentred;
invariant gl_Position;

void place() { gl_Position = clipFromCentred * vec4(positionCentred, 1.0); }
