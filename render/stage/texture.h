// Pictures on surfaces: factors of a material's colour, and of its roughness.
#pragma once

#include "srf/image/image.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <filesystem>
#include <memory>

namespace surflect::stage {

enum class Texels { colors, factors };

// 3 channels. Colours in 8 or 16 bits are sRGB, and come out linear; factors are as stored. Alpha plays no
// part. Throws Error naming the file, also where a float is not in 0..1 or a colour outside of Rec. 709's
// gamut.
image::Image readTexels(const std::filesystem::path& picture, Texels what);

class Texture {
public:
  // What readTexels() gives, `columns` times across and `rows` times up the surface.
  Texture(std::shared_ptr<const image::Image> texels, int columns, int rows);

  // Linear between the middles of texels; (0, 0) is the picture's lower left corner.
  Rgb at(const Vec2<double>& st) const;

private:
  std::shared_ptr<const image::Image> texels_;
  double columns_, rows_;
};

// What a material's parameters are multiplied by; null where they are the same all over.
struct Textures {
  std::shared_ptr<const Texture> color = nullptr;
  std::shared_ptr<const Texture> roughness = nullptr; // by red

  bool any() const { return color || roughness; }
};

} // namespace surflect::stage
