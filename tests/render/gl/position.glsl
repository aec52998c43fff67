layout(location = 0) in vec3 positionObject;
uniform mat4 clipFromObject;
invariant gl_Position;

void place() { gl_Position = clipFromObject * vec4(positionObject, 1.0); }
