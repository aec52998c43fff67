// Arrays that shaders read and write, at the bindings of their `buffer` blocks.
#pragma once

#include "render/gl/handle.h"

#include <cstddef>
#include <cstdint>
#include <span>

namespace surflect::gl {

class StorageBuffer {
public:
  // The content is undefined. Throws Error if there is not enough memory.
  explicit StorageBuffer(size_t bytes);

  size_t bytes() const { return bytes_; }
  // Replaces the first bytes.
  void upload(std::span<const std::byte> content);
  // Sets all words of 32 bits.
  void clear(uint32_t word);
  // Makes the buffer that of a binding, for all draws that follow.
  void bind(unsigned binding) const;
  // A word of 32 bits, after all draws before.
  uint32_t read(size_t word) const;

private:
  Handle handle_;
  size_t bytes_;
};

// Makes what shaders have stored visible to the draws that follow.
void finishStores();

} // namespace surflect::gl
