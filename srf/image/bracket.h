// Merges several exposures of one scene into one picture of higher dynamic range.
//
// [Debevec 1997] P. Debevec, J. Malik: Recovering High Dynamic Range Radiance Maps from Photographs.
//   z  stored value     w  weight     X  exposure, E dt     E  radiance     dt  seconds
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

namespace surflect::image {

// Response curve of an 8-bit camera.

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

// Confidence in a stored value: largest in the middle of the range, 0 at black and where the value is
// clipped. [Debevec 1997, Eq. 4]
inline float hatWeight(float z, float zMin, float zMax) {
  return z <= (zMin + zMax) / 2 ? std::max(0.f, z - zMin) : std::max(0.f, zMax - z);
}

// One channel of one pixel in one exposure; z is NaN if the sample is missing.
struct ExposureSample {
  float z = 0;        // stored value; the range is 0..zMax
  float exposure = 0; // linear exposure X of z
  float seconds = 1;
};

// [Debevec 1997, Eq. 6], but averaging E where the paper averages ln E, because noise in linear pictures may
// be negative. If no sample has weight, returns the longest exposed of the samples that are not clipped
// (black in all exposures), or the shortest if all are clipped. NaN without samples.
inline float mergedRadiance(std::span<const ExposureSample> samples, float zMax) {
  const auto radiance = [](const ExposureSample& s) { return s.exposure / s.seconds; };
  float sum = 0, weights = 0;
  const ExposureSample *longestOpen = nullptr, *shortest = nullptr;
  for (const ExposureSample& s : samples) {
    if (std::isnan(s.z)) continue;
    const float w = hatWeight(s.z, 0, zMax);
    sum += w * radiance(s);
    weights += w;
    if (s.z < zMax && (!longestOpen || s.seconds > longestOpen->seconds)) longestOpen = &s;
    if (!shortest || s.seconds < shortest->seconds) shortest = &s;
  }
  if (weights > 0) return sum / weights;
  if (!shortest) return std::numeric_limits<float>::quiet_NaN();
  return radiance(longestOpen ? *longestOpen : *shortest);
}

} // namespace surflect::image
