// Pictures on surfaces: factors of a material's diffuse colour.
#pragma once

#include "srf/image/image.h"
#include "surfel/rgb.h"
#include "surfel/space.h"

#include <filesystem>
#include <memory>

namespace surflect {

// Linear RGB. Pictures of 8 or 16 bits are sRGB, of which alpha plays no part. Throws Error naming the file,
// also where a float is not in 0..1.
Image readTexels(const std::filesystem::path& picture);

class Texture {
public:
  // What readTexels() gives, `columns` times across and `rows` times up the surface.
  Texture(std::shared_ptr<const Image> texels, int columns, int rows);

  // Linear between the middles of texels; (0, 0) is the picture's lower left corner.
  Rgb at(const Vec2<double>& st) const;

private:
  std::shared_ptr<const Image> texels_;
  double columns_, rows_;
};

} // namespace surflect
