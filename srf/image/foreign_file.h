// Completes what OpenImageIO reports about a foreign picture file.
#pragma once

#include "srf/image/color.h"
#include "srf/image/foreign/foreign.h"
#include "srf/image/image_file.h"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace surflect::image {

// Fourth byte and colours of a Windows bitmap, as its header states them.
struct BmpHeader {
  bool declaresAlpha = false; // a bit mask for alpha exists; otherwise the fourth byte has no defined meaning
  std::optional<ColorStatement> color;
};

// Throws Error, without the file's name, if 32-bit pixels are in another order than blue, green, red, alpha.
// Other faults are left to the reader of the pixels.
BmpHeader bmpHeader(std::string_view file);

// Colour statements of JPEG and WebP files that OpenImageIO does not pass on.

// Statement of an ICC profile for a picture with this many colour channels; a damaged profile is its
// `problem`.
ColorStatement profileStatement(std::string source, std::string_view profile, int channels);

// Statement by EXIF's colour space: sRGB, or Adobe RGB, which cameras without profiles mean by "uncalibrated"
// with interoperability index R03. 'Uncalibrated' without R03 gives a statement with an empty encoding. None
// without EXIF.
std::optional<ColorStatement> exifColorStatement(std::string_view jpeg);

// ICC profile of a WebP file; empty if there is none.
std::string_view webpProfile(std::string_view file);

// Damage of compressed pixels that decoders fill up without a complaint; empty if there is none. A JPEG must
// reach its end marker. In a WebP, 64 zero bytes in a row are a lost part: no encoder writes so many.
std::string jpegDamage(std::string_view file);
std::string webpDamage(std::string_view file);

// Adds the colour statement, and drops the fourth channel of a BMP or Targa whose pixels show that it is not
// alpha. `extension` is in lower case. Throws Error.
Picture completed(ForeignPicture read, const std::filesystem::path& path, std::string_view extension);

} // namespace surflect::image
