// Lossless compression for the EXR and PNG writers.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace surflect::image {

// A zlib stream [RFC 1950], by libdeflate's fastest level; the same bytes for the same input.
std::string zlibStream(std::span<const std::byte> bytes);

} // namespace surflect::image
