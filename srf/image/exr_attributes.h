// The attributes in the header of an OpenEXR file, before the library trusts them.
#pragma once

#include <filesystem>

namespace surflect::image {

// The library makes room for an attribute before it reads it, and reads as much as an attribute's type asks
// for, whatever size the file says. Throws Error where an attribute is longer than the rest of the file, or
// of another size than its type. What else is wrong with a header is the library's to say.
void requireHonestAttributes(const std::filesystem::path& path);

} // namespace surflect::image
