// Linear light to 8-bit sRGB without a power function per sample.
#pragma once

#include "srf/image/color.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

namespace surflect::image {

// Byte nearest to the sRGB curve, from a table of the thresholds between bytes. Floats are bucketed by their
// leading 16 bits. The curve rises by at most 0.44 of a byte per bucket, so no bucket holds more than one
// threshold.
class SrgbBytes {
public:
  SrgbBytes() {
    for (unsigned byte = 1; byte < 256; ++byte) least_[byte] = leastOf(byte);
    least_[256] = 2; // never reached
    for (uint32_t bucket = 0, byte = 0; bucket < kBuckets; ++bucket) {
      const float first = std::bit_cast<float>((bucket + kFirst) << 16);
      while (first >= least_[byte + 1]) ++byte;
      ofBucket_[bucket] = static_cast<uint8_t>(byte);
    }
  }

  // Values are clamped to 0..1; NaN becomes 0.
  uint8_t operator()(float linear) const {
    const float unit = linear > kDark ? std::min(linear, 1.f) : kDark;
    const uint32_t byte = ofBucket_[(std::bit_cast<uint32_t>(unit) >> 16) - kFirst];
    return static_cast<uint8_t>(byte + (unit >= least_[byte + 1]));
  }

private:
  static constexpr float kDark = 0x1p-13f; // 0.4 of a byte, which is black
  static constexpr uint32_t kFirst = std::bit_cast<uint32_t>(kDark) >> 16;
  static constexpr uint32_t kBuckets = (std::bit_cast<uint32_t>(1.f) >> 16) - kFirst + 1;

  // Smallest float whose byte is at least `byte`.
  static float leastOf(unsigned byte) {
    uint32_t below = 0, least = std::bit_cast<uint32_t>(1.f);
    while (least - below > 1) {
      const uint32_t middle = below + (least - below) / 2;
      (std::lround(255 * srgbFromLinear(std::bit_cast<float>(middle))) < long{byte} ? below : least) = middle;
    }
    return std::bit_cast<float>(least);
  }

  std::array<float, 257> least_{};
  std::array<uint8_t, kBuckets> ofBucket_{};
};

} // namespace surflect::image
