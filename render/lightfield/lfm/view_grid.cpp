#include "render/lightfield/lfm/view_grid.h"

#include "surfel/base/error.h"

#include <string>

namespace surflect::lfm {

ViewGrid::ViewGrid(int size) : size_(size) {
  if (size < 2 || size > kLargest)
    throw Error::mismatch("2 to " + std::to_string(kLargest), std::to_string(size)).at("grid");
}

DiscPoint ViewGrid::center(size_t cell) const {
  const size_t side = static_cast<size_t>(size_);
  return DiscPoint(static_cast<double>(cell % side) + 0.5, static_cast<double>(cell / side) + 0.5) / size_;
}

bool ViewGrid::isInDisc(size_t cell) const { return (2 * center(cell) - DiscPoint(1, 1)).squaredNorm() <= 1; }

} // namespace surflect::lfm
