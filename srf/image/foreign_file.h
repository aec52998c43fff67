// Completes what OpenImageIO reports about a foreign picture file.
#pragma once

#include "srf/image/foreign/foreign.h"
#include "srf/image/image_file.h"

#include <filesystem>
#include <string_view>

namespace surflect::image {

// Adds the colour statement, and drops the fourth channel of a BMP or Targa whose pixels show that it is not
// alpha. `extension` is in lower case. Throws Error.
Picture completed(ForeignPicture read, const std::filesystem::path& path, std::string_view extension);

} // namespace surflect::image
