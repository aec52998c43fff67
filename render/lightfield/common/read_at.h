// Positioned reads of files that stay open while frames are rendered.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace surflect::lightfield {

// Reads bytes.size() bytes at a position in a file. Safe from many threads at once. Throws Error without the
// file's name, also if the file ends before.
void readAt(int descriptor, std::span<std::byte> bytes, uint64_t position);

} // namespace surflect::lightfield
