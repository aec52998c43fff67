// Float images in memory: row 0 on top, channels interleaved.
#pragma once

#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect::image {

struct Image {
  int width = 0, height = 0, channels = 0;
  std::vector<float> values; // width * height * channels

  Image() = default;
  Image(int w, int h, int c)
      : width(w), height(h), channels(c),
        values(static_cast<size_t>(w) * static_cast<size_t>(h) * static_cast<size_t>(c)) {}

  std::span<float> at(int x, int y) { return {values.data() + offset(x, y), static_cast<size_t>(channels)}; }
  std::span<const float> at(int x, int y) const {
    return {values.data() + offset(x, y), static_cast<size_t>(channels)};
  }

private:
  size_t offset(int x, int y) const {
    assert(x >= 0 && y >= 0 && x < width && y < height);
    return (static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)) *
           static_cast<size_t>(channels);
  }
};

// Largest pictures that are read. Files that claim more are refused before memory is taken for them.
inline constexpr int kMostSide = 1 << 16; // pixels
inline constexpr int64_t kMostPixels = int64_t{1} << 28;

// Colours composited over black, as in frames and EXR files.

// RGBA with colours multiplied by alpha, from straight colours (3 channels) and alpha (1 channel) of one
// size.
inline Image overBlack(const Image& color, const Image& alpha) {
  assert(color.channels == 3 && alpha.channels == 1);
  assert(color.width == alpha.width && color.height == alpha.height);
  Image over(alpha.width, alpha.height, 4);
  for (size_t i = 0; i < alpha.values.size(); ++i) {
    for (size_t c = 0; c < 3; ++c) over.values[4 * i + c] = alpha.values[i] * color.values[3 * i + c];
    over.values[4 * i + 3] = alpha.values[i];
  }
  return over;
}

// Percentiles of streams of values.

// Histogram of positive values by their leading 20 bits: percentiles to a relative error of 2^-12, in 8 MiB.
class PercentileCounter {
public:
  // Negative values and NaN count as 0.
  void add(float value) {
    ++total_;
    if (value > 0) ++bins_[std::bit_cast<uint32_t>(value) >> kDropped];
  }
  uint64_t count() const { return total_; }

  // Value below which this share of all values lies; 0 if it is not positive.
  double percentile(double share) const {
    auto above = static_cast<uint64_t>((1 - share) * static_cast<double>(total_));
    for (size_t bin = bins_.size(); bin-- > 0; above -= bins_[bin])
      if (bins_[bin] > above)
        return static_cast<double>(std::bit_cast<float>(static_cast<uint32_t>(bin) << kDropped));
    return 0;
  }

private:
  static constexpr int kDropped = 11; // low bits of 31
  std::vector<uint64_t> bins_ = std::vector<uint64_t>(size_t{1} << 20);
  uint64_t total_ = 0;
};

} // namespace surflect::image
