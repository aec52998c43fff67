// Pictures by their file name: .exr, .png and .hdr here, .jpg, .tif, .bmp, .tga, .ppm and .webp by
// OpenImageIO, which is loaded only then.
#pragma once

#include "srf/image/color_encoding.h"
#include "srf/image/image.h"

#include <filesystem>
#include <optional>

namespace surflect::image {

enum class PictureFormat { exr, png, radiance, foreign };
// By the extension alone, in either case of letters.
PictureFormat formatOf(const std::filesystem::path& path);
// Whether readPicture() knows the extension, in either case of letters.
bool isPictureName(const std::filesystem::path& path);

struct Picture {
  Image image;                         // 1 gray, 2 gray and alpha, 3 RGB, 4 RGBA
  int bits = 0;                        // of an encoded sample, values then in 0..1; 0: floating point
  bool alphaPremultiplied = false;     // colours are scaled by alpha, as in EXR; else straight, as in PNG
  std::optional<ColorStatement> color; // what the file says of its colours; none: nothing
  int orientation = 1; // 2 to 8: a viewer would mirror or turn it [EXIF 2.32, tag 0x0112]; it is not

  bool isFloat() const { return bits == 0; }
  bool hasAlpha() const { return image.channels == 2 || image.channels == 4; }
};

// An EXR gives the layer without a name. Throws Error, also where the reader for foreign formats is missing.
Picture readPicture(const std::filesystem::path& path);

struct PictureSize {
  int width = 0, height = 0; // pixels

  friend bool operator==(const PictureSize&, const PictureSize&) = default;
};
struct PictureHeader {
  PictureSize size;
  bool hasAlpha = false; // of an EXR: in the layer without a name
  int orientation = 1;   // these three as in Picture
  int bits = 0;
  std::optional<ColorStatement> color;
};
// Reads the file's header, and the pixels of a BMP or Targa of 32 bits, which tell whether there is alpha.
PictureHeader readPictureHeader(const std::filesystem::path& path);
// Reads the file's header only.
PictureSize readPictureSize(const std::filesystem::path& path);

} // namespace surflect::image
