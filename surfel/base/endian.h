// Whole numbers in the bytes of a file, in either byte order.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace surflect {

// Number in `count` bytes (at most 4) that lie within `bytes`, the least significant one first.
inline uint32_t littleEndian(std::string_view bytes, size_t at, size_t count = 4) {
  assert(count <= 4 && at + count <= bytes.size());
  uint32_t value = 0;
  for (size_t i = count; i-- > 0;) value = value << 8 | static_cast<uint8_t>(bytes[at + i]);
  return value;
}

// Number in `count` bytes (at most 4) that lie within `bytes`, the most significant one first.
inline uint32_t bigEndian(std::string_view bytes, size_t at, size_t count = 4) {
  assert(count <= 4 && at + count <= bytes.size());
  uint32_t value = 0;
  for (size_t i = 0; i < count; ++i) value = value << 8 | static_cast<uint8_t>(bytes[at + i]);
  return value;
}

} // namespace surflect
