// Lossless compression, for the EXR and PNG writers and files of our own.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace surflect::image {

// A zlib stream [RFC 1950] by libdeflate at an effort of 1, the fastest, to 12; the same bytes for the same
// input.
std::string zlibStream(std::span<const std::byte> bytes, size_t effort = 1);

// Inflates a zlib stream. Returns whether it is valid and has exactly as many bytes as `bytes`.
bool inflatesTo(std::span<const std::byte> stream, std::span<std::byte> bytes);

} // namespace surflect::image
