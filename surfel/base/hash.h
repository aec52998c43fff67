// 64-bit content hash (XXH3) for checksums and identities of files; not cryptographic.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace surflect {

uint64_t contentHash(std::span<const std::byte> bytes);
std::string hex(uint64_t hash);

} // namespace surflect
