// Statements of JPEG and WebP files about their colours that OpenImageIO does not pass on.
#pragma once

#include "srf/image/color_encoding.h"

#include <optional>
#include <string>
#include <string_view>

namespace surflect::image {

// The statement of a profile of a picture with so many colour channels; damage is its problem.
ColorStatement profileStatement(std::string source, std::string_view profile, int channels);

// By EXIF's colour space: sRGB, or Adobe RGB, which cameras without profiles mean by "uncalibrated" and the
// interoperability index R03. An EXIF colour space 'uncalibrated' without R03 gives a statement with an empty
// encoding. None where there is no EXIF.
std::optional<ColorStatement> exifColorStatement(std::string_view jpeg);

// The ICC profile of a WebP file; empty where there is none.
std::string_view webpProfile(std::string_view file);

} // namespace surflect::image
