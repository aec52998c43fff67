// The sRGB curve and luma.
//
// [IEC 61966-2-1] the sRGB standard; [BT.709] the weights of its primaries.
#pragma once

#include "surfel/math/rgb.h"

#include <cmath>

namespace surflect::image {

// Encoded value to linear light; both pieces of the curve are extended beyond 0 and 1.  [IEC 61966-2-1]
inline float linearFromSrgb(float encoded) {
  return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

// Linear light to encoded value, the inverse of linearFromSrgb.
inline float srgbFromLinear(float linear) {
  return linear <= 0.0031308f ? 12.92f * linear : 1.055f * std::pow(linear, 1 / 2.4f) - 0.055f;
}

// Luma of a colour; the weights sum to one.  [BT.709]
inline float luma(Rgb c) { return 0.2126f * c.r + 0.7152f * c.g + 0.0722f * c.b; }

} // namespace surflect::image
