// Light field maps in the driver's memory.
#pragma once

#include "render/gl/context.h"
#include "render/gl/texture.h"
#include "render/lightfield/lfm/maps.h"

#include <cstddef>

namespace surflect::lfm {

class MapTextures {
public:
  // Throws Error if the maps do not fit into the driver's textures, or memory.
  MapTextures(const LightFieldMaps& maps, const gl::Limits& limits);

  const gl::Texture& surface() const { return surface_; }
  const gl::Texture& view() const { return view_; }
  const gl::Texture& mean() const { return mean_; }

  // Where the maps of each triangle are, in floats: texel n is (n % kPlacesWidth, n / kPlacesWidth). A
  // triangle has one texel for its mean map, then for each term those of its surface maps (1 if packed, else
  // 3, by corner) and of the view maps of its 3 corners:
  //   mean, surface  x and y of sample (0, 0) of its map, layer, and a code: 1 if samples go on to the right
  //                  and up, -1 if to the left and down; times 1, 2 or 3 for red, green or blue
  //   view           x and y of the map's first texel, layer, and the scale of vertex and term
  const gl::Texture& places() const { return places_; }
  static constexpr int kPlacesWidth = 2048;

  size_t layers() const; // of all textures of maps
  size_t bytes() const;  // of all textures, as the driver holds them

private:
  gl::Texture surface_, view_, mean_, places_;
};

} // namespace surflect::lfm
