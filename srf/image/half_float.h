// Conversion between floats and half floats, written so that compilers vectorise loops over it.
#pragma once

#include <bit>
#include <cstdint>

namespace surflect::image {

// Bits of the half nearest to a float, ties to even [IEEE 754-2008, 3.6 and 4.3.1]. Finite values beyond
// +-65504, the largest half, are clamped; infinities and NaN are kept.
inline uint16_t nearestHalf(float value) {
  constexpr int32_t kInfinity = 0x7f800000, kLargest = 0x477fe000, kLeastNormal = 0x38800000; // 65504, 2^-14
  const int32_t bits = std::bit_cast<int32_t>(value), size = bits & 0x7fffffff;
  const int32_t finite = size < kLargest ? size : kLargest;
  // The mantissa has 13 bits fewer, the exponent's bias is 112 less.
  const int32_t normal = (finite + 0xfff + (finite >> 13 & 1) - (112 << 23)) >> 13;
  // Below 2^-14 halves are multiples of 2^-24, like floats from 1/2 to 1: the addition rounds to them.
  const int32_t subnormal = std::bit_cast<int32_t>(std::bit_cast<float>(finite) + 0.5f) - 0x3f000000;
  const int32_t payload = (size & 0x7fffff) >> 13;
  const int32_t noNumber = payload | (payload == 0);
  const int32_t special = 0x7c00 | (size > kInfinity ? noNumber : 0);
  const int32_t half = size >= kInfinity ? special : finite < kLeastNormal ? subnormal : normal;
  return static_cast<uint16_t>((bits >> 16 & 0x8000) | half);
}

// Bits of a half that is finite: 0 for NaN, the largest half for infinity.
inline uint16_t finiteHalf(float value) {
  constexpr uint16_t kInfinity = 0x7c00;
  const uint16_t half = nearestHalf(value), size = half & 0x7fff;
  return size < kInfinity ? half : size > kInfinity ? uint16_t{0} : static_cast<uint16_t>(half - 1);
}

// The float of a half, exact.
inline float floatOfHalf(uint16_t half) {
  const uint32_t sign = (half & 0x8000u) << 16, size = half & 0x7fffu;
  const uint32_t subnormal = std::bit_cast<uint32_t>(static_cast<float>(size) * 0x1p-24f);
  const uint32_t normal = (size << 13) + (112u << 23), special = size << 13 | 0x7f800000u;
  return std::bit_cast<float>(sign | (size < 0x400 ? subnormal : size < 0x7c00 ? normal : special));
}

} // namespace surflect::image
