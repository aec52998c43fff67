#version 450 core
layout(binding = 0) uniform sampler2DArray textures;
uniform int layer;
uniform float weight;
in vec2 place;
out vec4 result;

void main() { result = weight * texture(textures, vec3(place, layer)); }
