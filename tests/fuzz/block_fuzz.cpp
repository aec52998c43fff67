#include "srf/codec/block.h"
#include "tests/fuzz/fuzz.h"

// The first byte says under how many lights the block was seen.
void surflect::fuzz_block(std::string_view input) {
  if (input.empty()) return;
  const size_t lights = 1 + static_cast<uint8_t>(input[0]);
  const codec::Block block = codec::decodeBlock(std::as_bytes(std::span(input.substr(1))), lights);
  float sum = 0; // reaches everything that look-ups reach
  for (int t = 0; t < codec::blockTexels; ++t)
    for (int k = 0; k < 3 * block.stride; ++k) sum += static_cast<float>(block.texel(t)[k]);
  for (size_t l = 0; l < lights; ++l)
    for (int k = 0; k < block.stride; ++k) sum += block.light(l)[k];
  if (sum != sum) __builtin_trap();
}
