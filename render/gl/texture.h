// Textures, and pictures to and from them.
#pragma once

#include "render/gl/buffers.h"
#include "srf/image/image.h"

#include <cstddef>
#include <span>
#include <vector>

namespace surflect::gl {

// Texel formats. 8-bit values are 0..1, those of rgba8s and rg8s -1..1; srgba8 stores colours by the sRGB
// curve. dxt1 and dxt5 have blocks of 4 x 4 texels (8 and 16 bytes), and can only be sampled.
enum class Format { rgba8, srgba8, rgba8s, rg8s, rgba16f, rgba32f, r32f, depth32f, dxt1, dxt5 };

int channelsOf(Format format);
bool isCompressed(Format format);
// Size of a layer in bytes. Compressed formats have whole blocks.
size_t bytesOf(Format format, int width, int height);

// Texels nearest to a picture's values, rounded here rather than by the driver. The picture must have the
// format's channels; not for compressed formats.
std::vector<std::byte> texelsOf(Format format, const image::Image& picture);
// Inverse of texelsOf(), exact for every texel.
image::Image pictureOf(Format format, int width, int height, std::span<const std::byte> texels);

// First texel of a rectangle in a texture, its layer and its level of detail; level 0 is the largest.
struct Place {
  int x = 0, y = 0, layer = 0, level = 0;
};

enum class Filter { nearest, linear };

struct TextureShape {
  Format format = Format::rgba8;
  int width = 0, height = 0;
  int layers = 0; // of an array texture; 0 for a plain one
  int levels = 1; // of detail
  Filter filter = Filter::linear;
};

// A 2D texture or an array of them, of fixed size. Sampling beyond the edge gives the edge's texels.
class Texture {
public:
  // The content is undefined. Throws Error if the driver cannot make it.
  explicit Texture(const TextureShape& shape);

  const TextureShape& shape() const { return shape_; }
  unsigned name() const { return handle_.name(); }

  // Replaces a rectangle of texels by a picture.
  void upload(const image::Image& picture, const Place& place = {});
  // Replaces a rectangle by texels in the texture's own format, without conversion. Rectangles of a
  // compressed format start at a block and have whole blocks, except at the texture's edge.
  void upload(std::span<const std::byte> texels, int width, int height, const Place& place = {});
  // Computes all levels from level 0.
  void fillLevels();

  // Returns the picture of a layer, exactly; not for compressed formats.
  image::Image read(int layer = 0, int level = 0) const;

private:
  TextureShape shape_;
  Handle handle_;
};

// A plain texture of a picture's size and content.
Texture textureOf(Format format, const image::Image& picture, Filter filter = Filter::linear);

} // namespace surflect::gl
