// Pictures on surfaces: factors of a material's diffuse colour.
#pragma once

#include "srf/image/image.h"
#include "surfel/rgb.h"
#include "surfel/space.h"

#include <filesystem>

namespace surflect {

class Texture {
public:
  // The picture `columns` times across and `rows` times up the surface. Those of 8 or 16 bits are sRGB, of
  // which alpha plays no part. Throws Error naming the file, also where a float is not in 0..1.
  Texture(const std::filesystem::path& picture, int columns, int rows);

  // Linear between the middles of texels; (0, 0) is the picture's lower left corner.
  Rgb at(const Vec2<double>& st) const;

private:
  Image linear_; // RGB
  double columns_, rows_;
};

} // namespace surflect
