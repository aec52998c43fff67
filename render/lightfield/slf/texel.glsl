// Textures in slots: layers of an array texture.
layout(binding = 0) uniform sampler2DArray slotTexels;
uniform vec2 slotTexelSize; // 1 / size of a slot
uniform vec2 textureExtent; // size of the region's textures, texels

// Texel at a place of the texture in a slot, bilinear; constant beyond the outermost centres.
vec4 texelAt(float slot, vec2 placeTexels) {
  vec2 within = clamp(placeTexels, vec2(0.5), textureExtent - 0.5);
  return textureLod(slotTexels, vec3(within * slotTexelSize, slot), 0.0);
}
