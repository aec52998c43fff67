// Response curve of an 8-bit camera.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace surflect::image {

// Exposure (radiance times seconds, in any one unit) of each 8-bit code, per colour channel: not negative,
// non-decreasing, and above 0 for the last code.
struct Response {
  static constexpr size_t codes = 256;
  std::array<std::array<float, codes>, 3> exposure{};

  // Exposure of an encoded value in 0..1; linear between codes, which occur under masks and premultiplied
  // alpha.
  float operator()(size_t channel, float encoded) const {
    const std::array<float, codes>& curve = exposure[channel];
    const float code = std::clamp(encoded, 0.f, 1.f) * (codes - 1); // NaN stays NaN
    if (!(code >= 0)) return code;
    const auto low = std::min(static_cast<size_t>(code), codes - 2);
    const float share = code - static_cast<float>(low);
    return (1 - share) * curve[low] + share * curve[low + 1];
  }

  friend bool operator==(const Response&, const Response&) = default;
};

} // namespace surflect::image
