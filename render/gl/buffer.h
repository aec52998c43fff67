// Immutable arrays in the driver's memory.
#pragma once

#include "render/gl/handle.h"

#include <cstddef>
#include <span>

namespace surflect::gl {

class Buffer {
public:
  // Throws Error if there is not enough memory.
  explicit Buffer(std::span<const std::byte> content);

  unsigned name() const { return handle_.name(); }
  size_t bytes() const { return bytes_; }

private:
  Handle handle_;
  size_t bytes_;
};

} // namespace surflect::gl
