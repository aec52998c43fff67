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

private:
  Handle handle_;
};

} // namespace surflect::gl
