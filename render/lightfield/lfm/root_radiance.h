// Maps hold square roots of radiance: their bytes then resolve dark places as well as bright ones, and
// factors fit both. In the paper the gamma curve of the photographs does this.
#pragma once

#include <algorithm>
#include <cmath>

namespace surflect::lfm {

// Square root of radiance; that of values below 0 is 0.
template <class Number> Number rootOf(Number radiance) { return std::sqrt(std::max(radiance, Number{0})); }

// Radiance of a square root, or of a sum of terms that stands for one: values below 0 are black.
template <class Number> Number radianceOf(Number root) {
  const Number positive = std::max(root, Number{0});
  return positive * positive;
}

} // namespace surflect::lfm
