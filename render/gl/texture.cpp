#include "render/gl/texture.h"

#include "render/gl/context.h"
#include "srf/image/color.h"
#include "srf/image/half_float.h"
#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>

namespace surflect::gl {

namespace {

constexpr int kBlockSide = 4; // of compressed formats, texels

struct FormatDetails {
  GLenum stored;         // internal format
  GLenum channels, type; // of texels in memory; none for a compressed format
  int count;             // of channels
  size_t bytes;          // of a texel, or of a block
};

FormatDetails detailsOf(Format format) {
  switch (format) {
  case Format::rgba8:
    return {GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE, 4, 4};
  case Format::srgba8:
    return {GL_SRGB8_ALPHA8, GL_RGBA, GL_UNSIGNED_BYTE, 4, 4};
  case Format::rgba8s:
    return {GL_RGBA8_SNORM, GL_RGBA, GL_BYTE, 4, 4};
  case Format::rg8s:
    return {GL_RG8_SNORM, GL_RG, GL_BYTE, 2, 2};
  case Format::rgba16f:
    return {GL_RGBA16F, GL_RGBA, GL_HALF_FLOAT, 4, 8};
  case Format::rgba32f:
    return {GL_RGBA32F, GL_RGBA, GL_FLOAT, 4, 16};
  case Format::r32f:
    return {GL_R32F, GL_RED, GL_FLOAT, 1, 4};
  case Format::depth32f:
    return {GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, GL_FLOAT, 1, 4};
  case Format::dxt1:
    return {GL_COMPRESSED_RGB_S3TC_DXT1_EXT, 0, 0, 3, 8};
  case Format::dxt5:
    return {GL_COMPRESSED_RGBA_S3TC_DXT5_EXT, 0, 0, 4, 16};
  }
  std::abort();
}

// Both arguments of the comparison are false for NaN, which becomes `low`.
float clamped(float value, float low) { return value > low ? std::min(value, 1.f) : low; }

uint8_t unsignedByte(float value) { return static_cast<uint8_t>(std::lround(255 * clamped(value, 0))); }
int8_t signedByte(float value) { return static_cast<int8_t>(std::lround(127 * clamped(value, -1))); }

std::array<float, 256> linearOfSrgbBytes() {
  std::array<float, 256> linear;
  for (size_t byte = 0; byte < linear.size(); ++byte)
    linear[byte] = image::linearFromSrgb(static_cast<float>(byte) / 255);
  return linear;
}

// Texels of one scalar type from floats, and back; the conversion may depend on the channel.
template <class Scalar, class Convert>
std::vector<std::byte> encoded(const std::vector<float>& values, const Convert& encode) {
  std::vector<std::byte> texels(values.size() * sizeof(Scalar));
  for (size_t i = 0; i < values.size(); ++i) {
    const Scalar scalar = encode(values[i], i % 4);
    std::memcpy(&texels[i * sizeof(Scalar)], &scalar, sizeof(Scalar));
  }
  return texels;
}

template <class Scalar, class Convert>
void decode(std::span<const std::byte> texels, std::vector<float>& values, const Convert& decoded) {
  for (size_t i = 0; i < values.size(); ++i) {
    Scalar scalar;
    std::memcpy(&scalar, &texels[i * sizeof(Scalar)], sizeof(Scalar));
    values[i] = decoded(scalar, i % 4);
  }
}

Handle created(const TextureShape& shape) {
  GLuint name = 0;
  glCreateTextures(shape.layers > 0 ? GL_TEXTURE_2D_ARRAY : GL_TEXTURE_2D, 1, &name);
  return {name, [](unsigned n) { glDeleteTextures(1, &n); }};
}

int levelSize(int size, int level) { return std::max(1, size >> level); }

} // namespace

int channelsOf(Format format) { return detailsOf(format).count; }

bool isCompressed(Format format) { return detailsOf(format).channels == 0; }

size_t bytesOf(Format format, int width, int height) {
  const int side = isCompressed(format) ? kBlockSide : 1;
  const auto blocks = [side](int size) { return static_cast<size_t>((size + side - 1) / side); };
  return blocks(width) * blocks(height) * detailsOf(format).bytes;
}

std::vector<std::byte> texelsOf(Format format, const image::Image& picture) {
  assert(!isCompressed(format) && picture.channels == channelsOf(format));
  const std::vector<float>& values = picture.values;
  switch (format) {
  case Format::rgba8:
    return encoded<uint8_t>(values, [](float v, size_t) { return unsignedByte(v); });
  case Format::srgba8:
    return encoded<uint8_t>(values, [bytes = image::SrgbBytes()](float v, size_t channel) {
      return channel < 3 ? bytes(v) : unsignedByte(v);
    });
  case Format::rgba8s:
  case Format::rg8s:
    return encoded<int8_t>(values, [](float v, size_t) { return signedByte(v); });
  case Format::rgba16f:
    return encoded<uint16_t>(values, [](float v, size_t) { return image::nearestHalf(v); });
  default:
    break;
  }
  const auto bytes = std::as_bytes(std::span(values));
  return {bytes.begin(), bytes.end()};
}

image::Image pictureOf(Format format, int width, int height, std::span<const std::byte> texels) {
  assert(!isCompressed(format) && texels.size() == bytesOf(format, width, height));
  image::Image picture(width, height, channelsOf(format));
  std::vector<float>& values = picture.values;
  switch (format) {
  case Format::rgba8:
    decode<uint8_t>(texels, values, [](uint8_t byte, size_t) { return static_cast<float>(byte) / 255; });
    break;
  case Format::srgba8:
    decode<uint8_t>(texels, values, [linear = linearOfSrgbBytes()](uint8_t byte, size_t channel) {
      return channel < 3 ? linear[byte] : static_cast<float>(byte) / 255;
    });
    break;
  case Format::rgba8s:
  case Format::rg8s:
    decode<int8_t>(texels, values,
                   [](int8_t byte, size_t) { return std::max(-1.f, static_cast<float>(byte) / 127); });
    break;
  case Format::rgba16f:
    decode<uint16_t>(texels, values, [](uint16_t half, size_t) { return image::floatOfHalf(half); });
    break;
  default:
    std::memcpy(values.data(), texels.data(), texels.size());
  }
  return picture;
}

namespace {

// Throws Error with size and limit, which the driver's own complaint lacks.
void requireWithinLimits(const TextureShape& shape) {
  GLint side = 0, layers = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &side);
  glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &layers);
  if (shape.width > side || shape.height > side)
    throw Error::mismatch("at most " + std::to_string(side) +
                              " each way, the limit of this OpenGL; "
                              "a smaller picture or fewer samples for each pixel (--samples 1) may fit",
                          "a picture of " + sizeText(shape.width, shape.height) + " texels")
        .in("OpenGL");
  if (shape.layers > layers)
    throw Error::mismatch("at most " + std::to_string(layers) + ", the limit of this OpenGL",
                          std::to_string(shape.layers) + " layers of a texture")
        .in("OpenGL");
}

} // namespace

Texture::Texture(const TextureShape& shape) : shape_(shape), handle_(created(shape)) {
  assert(shape.width > 0 && shape.height > 0 && shape.layers >= 0 && shape.levels > 0);
  requireWithinLimits(shape);
  const GLenum stored = detailsOf(shape.format).stored;
  if (shape.layers > 0)
    glTextureStorage3D(name(), shape.levels, stored, shape.width, shape.height, shape.layers);
  else
    glTextureStorage2D(name(), shape.levels, stored, shape.width, shape.height);
  const bool isLinear = shape.filter == Filter::linear;
  const GLint within = isLinear ? GL_LINEAR : GL_NEAREST;
  const GLint between = isLinear ? GL_LINEAR_MIPMAP_LINEAR : GL_NEAREST_MIPMAP_NEAREST;
  glTextureParameteri(name(), GL_TEXTURE_MAG_FILTER, within);
  glTextureParameteri(name(), GL_TEXTURE_MIN_FILTER, shape.levels > 1 ? between : within);
  glTextureParameteri(name(), GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTextureParameteri(name(), GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  requireNoErrors();
}

void Texture::upload(const image::Image& picture, const Place& place) {
  upload(texelsOf(shape_.format, picture), picture.width, picture.height, place);
}

void Texture::upload(std::span<const std::byte> texels, int width, int height, const Place& place) {
  assert(texels.size() == bytesOf(shape_.format, width, height));
  const FormatDetails details = detailsOf(shape_.format);
  const auto size = static_cast<GLsizei>(texels.size());
  const bool compressed = isCompressed(shape_.format), isArray = shape_.layers > 0;
  if (compressed && isArray)
    glCompressedTextureSubImage3D(name(), place.level, place.x, place.y, place.layer, width, height, 1,
                                  details.stored, size, texels.data());
  else if (compressed)
    glCompressedTextureSubImage2D(name(), place.level, place.x, place.y, width, height, details.stored, size,
                                  texels.data());
  else if (isArray)
    glTextureSubImage3D(name(), place.level, place.x, place.y, place.layer, width, height, 1,
                        details.channels, details.type, texels.data());
  else
    glTextureSubImage2D(name(), place.level, place.x, place.y, width, height, details.channels, details.type,
                        texels.data());
}

void Texture::fillLevels() { glGenerateTextureMipmap(name()); }

image::Image Texture::read(int layer, int level) const {
  assert(!isCompressed(shape_.format));
  const int width = levelSize(shape_.width, level), height = levelSize(shape_.height, level);
  const FormatDetails details = detailsOf(shape_.format);
  const auto readInto = [&](std::span<std::byte> texels) {
    glGetTextureSubImage(name(), level, 0, 0, layer, width, height, 1, details.channels, details.type,
                         static_cast<GLsizei>(texels.size()), texels.data());
    requireNoErrors();
  };
  if (details.type == GL_FLOAT) {
    image::Image picture(width, height, details.count);
    readInto(std::as_writable_bytes(std::span(picture.values)));
    return picture;
  }
  std::vector<std::byte> texels(bytesOf(shape_.format, width, height));
  readInto(texels);
  return pictureOf(shape_.format, width, height, texels);
}

Texture textureOf(Format format, const image::Image& picture, Filter filter) {
  Texture texture({format, picture.width, picture.height, 0, 1, filter});
  texture.upload(picture);
  return texture;
}

} // namespace surflect::gl
