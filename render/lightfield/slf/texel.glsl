// Textures in slots: layers of array textures, each with slotLayers but the last.
const int kArrays = 8;
layout(binding = 0) uniform sampler2DArray slotTexels[kArrays];
uniform int slotLayers;
uniform vec2 slotTexelSize; // 1 / size of a slot
uniform vec2 textureExtent; // size of the region's textures, texels

// Texel at a place of the texture in a slot, bilinear; constant beyond the outermost centres.
vec4 texelAt(float slot, vec2 placeTexels) {
  vec2 within = clamp(placeTexels, vec2(0.5), textureExtent - 0.5);
  int array = int(slot) / slotLayers;
  vec3 place = vec3(within * slotTexelSize, int(slot) - array * slotLayers);
  // An index of samplers must be the same for all pixels of a draw, whose slots may be in several arrays.
  switch (array) {
  case 0: return textureLod(slotTexels[0], place, 0.0);
  case 1: return textureLod(slotTexels[1], place, 0.0);
  case 2: return textureLod(slotTexels[2], place, 0.0);
  case 3: return textureLod(slotTexels[3], place, 0.0);
  case 4: return textureLod(slotTexels[4], place, 0.0);
  case 5: return textureLod(slotTexels[5], place, 0.0);
  case 6: return textureLod(slotTexels[6], place, 0.0);
  default: return textureLod(slotTexels[7], place, 0.0);
  }
}
