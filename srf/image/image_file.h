// Reads pictures by their file name: .exr, .png and .hdr directly; .jpg, .tif, .bmp, .tga, .ppm, .webp and
// camera raw by OpenImageIO, which is loaded on demand.
#pragma once

#include "srf/image/color.h"
#include "srf/image/image.h"

#include <filesystem>
#include <optional>
#include <vector>

namespace surflect::image {

enum class PictureFormat { exr, png, radiance, foreign };
// Format by the extension alone, in any letter case.
PictureFormat formatOf(const std::filesystem::path& path);
// Returns whether readPicture() supports the extension, in any letter case.
bool isPictureName(const std::filesystem::path& path);
// Returns whether the extension is one of camera raw that readPicture() supports, in any letter case.
bool isRawName(const std::filesystem::path& path);
// Removes camera raw files that have a developed picture beside them: of the same folder and name, but for
// the extension. Cameras write both.
void removeDevelopedRaw(std::vector<std::filesystem::path>& pictures);

struct Picture {
  Image image;  // 1 grey, 2 grey and alpha, 3 RGB, 4 RGBA
  int bits = 0; // bits of an integer sample, whose values are in 0..1; 0: floating point
  bool alphaPremultiplied =
      false; // colours are multiplied by alpha, as in EXR; otherwise straight, as in PNG
  std::optional<ColorStatement> color; // the file's colour statement, if it has one
  int orientation =
      1; // 2 to 8: viewers mirror or rotate the picture [EXIF 2.32, tag 0x0112]; this reader does not

  bool isFloat() const { return bits == 0; }
  bool hasAlpha() const { return image.channels == 2 || image.channels == 4; }
};

// Reads a picture; of an EXR the layer without a name. Throws Error, also for a picture that is cut off,
// which decoders fill up, and if the reader for foreign formats is missing.
Picture readPicture(const std::filesystem::path& path);
// Decodes a picture, of an EXR all layers, in order to throw the Error that reading it would.
void decodePicture(const std::filesystem::path& path);

struct PictureSize {
  int width = 0, height = 0; // pixels

  friend bool operator==(const PictureSize&, const PictureSize&) = default;
};
struct PictureHeader {
  PictureSize size;
  bool hasAlpha = false; // EXR: of the layer without a name
  int orientation = 1;   // bits, alphaPremultiplied and orientation as in Picture
  int bits = 0;
  std::optional<ColorStatement> color;
};
// Reads the header, and the pixels of a 32-bit BMP or Targa, which show whether it has alpha.
PictureHeader readPictureHeader(const std::filesystem::path& path);
// Reads only the header.
PictureSize readPictureSize(const std::filesystem::path& path);

} // namespace surflect::image
