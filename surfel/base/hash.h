// 64-bit content hash (XXH3) for checksums and identities of files; not cryptographic.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace surflect {

uint64_t contentHash(std::span<const std::byte> bytes);
uint64_t contentHash(std::string_view text);
std::string hex(uint64_t hash);

} // namespace surflect
