// Regular grid of viewing directions: cells of the square around the disc of a vertex.  [Chen 2002, §5.2]
//
// Cell (i, j) is stored at j * size + i, with its centre at ((i + 1/2) / size, (j + 1/2) / size), as the
// texels of a texture.
#pragma once

#include "render/lightfield/lfm/direction_disc.h"

#include <cstddef>

namespace surflect::lfm {

class ViewGrid {
public:
  // Throws Error unless 2 <= size <= kLargest.
  explicit ViewGrid(int size = 32);
  static constexpr int kLargest = 256;

  int size() const { return size_; }
  size_t cells() const { return static_cast<size_t>(size_) * static_cast<size_t>(size_); }
  DiscPoint center(size_t cell) const;
  // Returns whether the centre is in the disc. Other cells show no direction, and count in no reported error.
  bool isInDisc(size_t cell) const;

private:
  int size_;
};

} // namespace surflect::lfm
