#include "srf/codec/alpha_plane.h"

#include "srf/codec/block.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

namespace surflect::codec {

namespace {

constexpr uint8_t kOpaqueLevel = 255;
constexpr uint32_t kClear = std::numeric_limits<uint32_t>::max(), kOpaque = kClear - 1;

std::vector<uint8_t> quantizedAlpha(const image::Image& alpha) {
  assert(alpha.channels == 1);
  std::vector<uint8_t> levels(alpha.values.size());
  std::ranges::transform(alpha.values, levels.begin(), [](float value) {
    return static_cast<uint8_t>(std::lround(kOpaqueLevel * std::clamp(value, 0.f, 1.f)));
  });
  return levels;
}

} // namespace

AlphaPlane::AlphaPlane(const image::Image& alpha)
    : AlphaPlane(alpha.width, alpha.height, quantizedAlpha(alpha)) {}

AlphaPlane::AlphaPlane(int width, int height, std::span<const uint8_t> levels)
    : width_(width), height_(height), across_((width + blockSize - 1) / blockSize) {
  assert(levels.size() == static_cast<size_t>(width) * static_cast<size_t>(height));
  for (int y0 = 0; y0 < height; y0 += blockSize)
    for (int x0 = 0; x0 < width; x0 += blockSize) {
      std::array<uint8_t, blockTexels> block; // beyond the border, the outermost pixel is repeated
      for (int y = 0; y < blockSize; ++y)
        for (int x = 0; x < blockSize; ++x)
          block[static_cast<size_t>(y * blockSize + x)] =
              levels[static_cast<size_t>(std::min(y0 + y, height - 1)) * static_cast<size_t>(width) +
                     static_cast<size_t>(std::min(x0 + x, width - 1))];
      const auto isAll = [&](uint8_t level) {
        return std::ranges::all_of(block, [level](uint8_t own) { return own == level; });
      };
      if (isAll(0)) {
        starts_.push_back(kClear);
      } else if (isAll(kOpaqueLevel)) {
        starts_.push_back(kOpaque);
      } else {
        starts_.push_back(static_cast<uint32_t>(texels_.size()));
        texels_.insert(texels_.end(), block.begin(), block.end());
      }
    }
}

uint8_t AlphaPlane::level(int x, int y) const {
  const uint32_t start = starts_[static_cast<size_t>(y / blockSize) * static_cast<size_t>(across_) +
                                 static_cast<size_t>(x / blockSize)];
  if (start == kClear) return 0;
  if (start == kOpaque) return kOpaqueLevel;
  return texels_[start + static_cast<uint32_t>(y % blockSize * blockSize + x % blockSize)];
}

std::vector<uint8_t> AlphaPlane::levels() const {
  std::vector<uint8_t> all;
  all.reserve(static_cast<size_t>(width_) * static_cast<size_t>(height_));
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) all.push_back(level(x, y));
  return all;
}

float AlphaPlane::at(float x, float y) const {
  assert(width_ > 0 && height_ > 0 && std::isfinite(x) && std::isfinite(y));
  const float u = std::min(std::max(x - 0.5f, 0.f), static_cast<float>(width_ - 1)),
              v = std::min(std::max(y - 0.5f, 0.f), static_cast<float>(height_ - 1));
  const int i = static_cast<int>(u), j = static_cast<int>(v);
  const int right = std::min(i + 1, width_ - 1), down = std::min(j + 1, height_ - 1);
  const float s = u - static_cast<float>(i), t = v - static_cast<float>(j);
  const auto row = [&](int at) {
    return std::lerp(static_cast<float>(level(i, at)), static_cast<float>(level(right, at)), s);
  };
  return std::lerp(row(j), row(down), t) / kOpaqueLevel;
}

} // namespace surflect::codec
