// Textures: factors of a material's colour and roughness.
#pragma once

#include "srf/image/image.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <filesystem>
#include <memory>

namespace surflect::stage {

enum class Texels { colors, factors };

// 3 channels. 8- and 16-bit colours are decoded from sRGB to linear; factors are as stored. Alpha is ignored.
// Throws Error naming the file, also if a float is outside of 0..1 or a colour outside of Rec. 709's gamut.
image::Image readTexels(const std::filesystem::path& picture, Texels what);

class Texture {
public:
  // `texels` from readTexels(), tiled `columns` times across and `rows` times up the surface.
  Texture(std::shared_ptr<const image::Image> texels, int columns, int rows);

  // Bilinear value at texture coordinates; (0, 0) is the picture's lower left corner.
  Rgb at(const Vec2<double>& st) const;

private:
  std::shared_ptr<const image::Image> texels_;
  double columns_, rows_;
};

// Factors of a material's parameters; null where constant.
struct Textures {
  std::shared_ptr<const Texture> color = nullptr;
  std::shared_ptr<const Texture> roughness = nullptr; // the red channel

  bool any() const { return color || roughness; }
};

} // namespace surflect::stage
