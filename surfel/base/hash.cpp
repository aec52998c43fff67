#include "surfel/base/hash.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

namespace surflect {

uint64_t contentHash(std::span<const std::byte> bytes) { return XXH3_64bits(bytes.data(), bytes.size()); }
uint64_t contentHash(std::string_view text) { return contentHash(std::as_bytes(std::span(text))); }

std::string hex(uint64_t hash) {
  std::string digits(16, '0');
  for (size_t i = 16; i-- > 0; hash >>= 4) digits[i] = "0123456789abcdef"[hash & 15];
  return digits;
}

} // namespace surflect
