// Float images in memory: row 0 on top, channels interleaved.
#pragma once

#include <cassert>
#include <cstddef>
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

} // namespace surflect::image
