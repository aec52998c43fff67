// What OpenImageIO does not say of a foreign file is read beside it.
#pragma once

#include "srf/image/foreign/foreign.h"
#include "srf/image/image_file.h"

#include <filesystem>
#include <string_view>

namespace surflect {

// The picture with its statement of colour, and without what a BMP's fourth byte holds where that is no
// alpha. The extension has small letters. Throws Error.
Picture completed(ForeignPicture read, const std::filesystem::path& path, std::string_view extension);

} // namespace surflect
