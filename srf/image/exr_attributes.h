// Checks the attributes in an OpenEXR header before the library reads them.
#pragma once

#include <filesystem>

namespace surflect::image {

// The library allocates the stated size of an attribute before it reads, and reads as much as the attribute's
// type requires. Throws Error if an attribute is longer than the rest of the file, or its size does not fit
// its type. Other faults are left to the library.
void requireHonestAttributes(const std::filesystem::path& path);

} // namespace surflect::image
