#include "render/lightfield/lfm/codeword_search.h"

#include "surfel/math/matrix_products.h"
#include "surfel/math/padded_rows.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace surflect::lfm {

namespace {

constexpr size_t kBlock = 64; // vectors that are compared with all codewords at once

double squaredLength(std::span<const float> vector) {
  double sum = 0;
  for (const float x : vector) sum += double{x} * double{x};
  return sum;
}

// Bound on the rounding error of a scalar product of unit vectors: sums are of 32 products, then of such
// sums.
double roundingOf(size_t dimension) {
  return (static_cast<double>(dimension) / 32 + 64) * double{std::numeric_limits<float>::epsilon()};
}

} // namespace

double squaredDistance(std::span<const float> a, std::span<const float> b) {
  double sums[4] = {};
  for (size_t i = 0; i < a.size(); ++i) {
    const double difference = double{a[i]} - double{b[i]};
    sums[i % 4] += difference * difference;
  }
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

Assignment nearestCodewords(const VectorSet& vectors, std::span<const float> codewords,
                            std::span<const uint32_t> before) {
  const size_t dimension = vectors.dimension, count = codewords.size() / dimension;
  PaddedRows<float> turned(dimension, count);
  std::vector<float> lengths(count);
  for (size_t i = 0; i < count; ++i) {
    const std::span<const float> codeword = codewords.subspan(i * dimension, dimension);
    lengths[i] = static_cast<float>(squaredLength(codeword));
    for (size_t d = 0; d < dimension; ++d) turned.row(d)[i] = codeword[d];
  }
  const double longest = std::sqrt(*std::ranges::max_element(lengths));
  const double rounding = roundingOf(dimension);

  Assignment result{std::vector<uint32_t>(vectors.size()), std::vector<double>(vectors.size())};
  const size_t blocks = (vectors.size() + kBlock - 1) / kBlock;
  tbb::parallel_for(size_t{0}, blocks, [&](size_t block) {
    const size_t first = block * kBlock, size = std::min(kBlock, vectors.size() - first);
    PaddedRows<float> products(size, count);
    multiply(MatrixProduct<float>{vectors.values.data() + first * dimension, dimension, 1, turned.row(0),
                                  turned.stride(), products.row(0), products.stride(), size, dimension,
                                  turned.stride(), false});
    for (size_t i = 0; i < size; ++i) {
      // |x - c|^2 - |x|^2 = |c|^2 - 2 x c
      float* const scores = products.row(i);
      float least = std::numeric_limits<float>::infinity();
      for (size_t j = 0; j < count; ++j) {
        scores[j] = lengths[j] - 2 * scores[j];
        least = std::min(least, scores[j]);
      }
      const std::span<const float> x = vectors.values.subspan((first + i) * dimension, dimension);
      const double size_x = std::sqrt(squaredLength(x));
      const double margin = 4 * rounding * longest * (size_x + longest);
      double nearest = std::numeric_limits<double>::infinity();
      size_t index = 0;
      const auto consider = [&](size_t j) {
        const double square = squaredDistance(x, codewords.subspan(j * dimension, dimension));
        if (square < nearest) {
          nearest = square;
          index = j;
        }
      };
      if (!before.empty()) consider(before[first + i]);
      for (size_t j = 0; j < count; ++j)
        if (double{scores[j]} <= double{least} + margin) consider(j);
      result.indices[first + i] = static_cast<uint32_t>(index);
      result.squares[first + i] = nearest;
    }
  });
  return result;
}

} // namespace surflect::lfm
