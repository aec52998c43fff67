#version 450 core
layout(binding = 0) uniform sampler2DArray layers;
uniform int layer;
uniform float weight;
out vec4 result;

void main() {
  vec2 size = vec2(textureSize(layers, 0).xy);
  result = weight * texture(layers, vec3(gl_FragCoord.xy / size, layer));
}
