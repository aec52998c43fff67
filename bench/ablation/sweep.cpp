#include "bench/ablation/sweep.h"

#include "render/evaluation/measure.h"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace surflect::bench {

SecondDifferences secondDifferences(std::span<const image::Image> pictures, const image::Mask& mask,
                                    double white) {
  assert(pictures.size() >= 3 && white > 0);
  evaluation::PooledMean squares;
  double largest = 0;
  for (size_t i = 1; i + 1 < pictures.size(); ++i)
    for (size_t pixel = 0; pixel < mask.inside.size(); ++pixel)
      for (size_t c = 0; mask.inside[pixel] && c < 3; ++c) {
        const auto value = [&](size_t step) {
          return double{pictures[step].values[pixel * static_cast<size_t>(pictures[step].channels) + c]};
        };
        const double second = (value(i - 1) - 2 * value(i) + value(i + 1)) / white;
        squares += {second * second, 1};
        largest = std::max(largest, std::abs(second));
      }
  return {std::sqrt(squares.mean()), largest};
}

} // namespace surflect::bench
