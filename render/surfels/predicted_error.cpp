#include "render/surfels/predicted_error.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <cmath>

namespace surflect::surfels {

namespace {

constexpr size_t kChannels = 4; // of the pictures; three are compared

double square(double x) { return x * x; }

// |a|^2
double meanSquare(std::span<const float> a) { return (square(a[0]) + square(a[1]) + square(a[2])) / 3; }

// |a - b|^2
double meanSquare(std::span<const float> a, std::span<const float> b) {
  return (square(double{a[0]} - b[0]) + square(double{a[1]} - b[1]) + square(double{a[2]} - b[2])) / 3;
}

// V(c) at a pixel, over the neighbours inside of the picture; mean of the channels.
double localVariance(const image::Image& color, int x, int y) {
  double sums[3] = {}, squares = 0, count = 0;
  for (int row = std::max(0, y - 1); row <= std::min(color.height - 1, y + 1); ++row)
    for (int column = std::max(0, x - 1); column <= std::min(color.width - 1, x + 1); ++column, ++count) {
      const std::span<const float> neighbour = color.at(column, row);
      for (size_t c = 0; c < 3; ++c) sums[c] += neighbour[c];
      squares += meanSquare(neighbour);
    }
  const double squaredMean = (square(sums[0]) + square(sums[1]) + square(sums[2])) / (3 * square(count));
  return std::max(0.0, squares / count - squaredMean);
}

} // namespace

std::vector<float> viewGaps(std::span<const float> confidence) {
  std::vector<float> gaps(confidence.size());
  std::ranges::transform(confidence, gaps.begin(), [](float trust) {
    return std::min(1.f, 1 / std::sqrt(std::sqrt(trust)) - 1); // trust = 1 / (1 + penalty)^4
  });
  return gaps;
}

image::Image predictedError(const image::Image& color, const image::Image& nearest, const image::Image& gap,
                            const ErrorModel& model, image::Image kept, const Progress& progress) {
  assert(color.channels == kChannels && nearest.values.size() == color.values.size() && gap.channels == 1 &&
         gap.width == color.width && gap.height == color.height);
  image::Image error = std::move(kept);
  error.width = color.width;
  error.height = color.height;
  error.channels = 1;
  error.values.resize(gap.values.size());
  tbb::parallel_for(0, color.height, [&](int y) {
    progress.checkpoint();
    for (int x = 0; x < color.width; ++x) {
      const std::span<const float> c = color.at(x, y);
      error.at(x, y)[0] = static_cast<float>(std::sqrt(model.disagreement * meanSquare(c, nearest.at(x, y)) +
                                                       model.structure * localVariance(color, x, y) +
                                                       model.gap * gap.at(x, y)[0] * meanSquare(c)));
    }
  });
  return error;
}

} // namespace surflect::surfels
