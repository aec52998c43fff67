// Colour statements of JPEG and WebP files that OpenImageIO does not pass on.
#pragma once

#include "srf/image/color_encoding.h"

#include <optional>
#include <string>
#include <string_view>

namespace surflect::image {

// Statement of an ICC profile for a picture with this many colour channels; a damaged profile is its
// `problem`.
ColorStatement profileStatement(std::string source, std::string_view profile, int channels);

// Statement by EXIF's colour space: sRGB, or Adobe RGB, which cameras without profiles mean by "uncalibrated"
// with interoperability index R03. 'Uncalibrated' without R03 gives a statement with an empty encoding. None
// without EXIF.
std::optional<ColorStatement> exifColorStatement(std::string_view jpeg);

// ICC profile of a WebP file; empty if there is none.
std::string_view webpProfile(std::string_view file);

} // namespace surflect::image
