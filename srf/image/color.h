// The sRGB curve and luma.
//
// [IEC 61966-2-1] the sRGB standard; [BT.709] the weights of its primaries.
#pragma once

#include "srf/image/image.h"
#include "surfel/math/rgb.h"
#include "surfel/math/space.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

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

// Colour encoding of a picture's stored values, and their conversion to the working space: linear light with
// Rec. 709 primaries and white.
// [BT.709] primaries, white and curve of HDTV; [IEC 61966-2-1] sRGB: the same primaries, another curve.
// [SMPTE RP 177] RGB to XYZ from chromaticities; [Lam 1985] Bradford's adaptation to another white.
//   P  columns are the primaries' XYZ of Y = 1     s  their luminances in white     W  XYZ of white, Y = 1
struct Chromaticity {
  double x = 0, y = 0; // CIE 1931

  friend bool operator==(const Chromaticity&, const Chromaticity&) = default;
};

struct Primaries {
  Chromaticity red, green, blue, white;

  friend bool operator==(const Primaries&, const Primaries&) = default;
};

inline constexpr Chromaticity kD65{0.3127, 0.3290};
inline constexpr Primaries kRec709{{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, kD65};
inline constexpr Primaries kAdobeRgb{{0.64, 0.33}, {0.21, 0.71}, {0.15, 0.06}, kD65};      // [Adobe RGB 1998]
inline constexpr Primaries kDisplayP3{{0.680, 0.320}, {0.265, 0.690}, {0.15, 0.06}, kD65}; // [H.273, code 12]
inline constexpr Primaries kRec2020{{0.708, 0.292}, {0.170, 0.797}, {0.131, 0.046}, kD65}; // [BT.2020]
inline constexpr Primaries kAces{
    {0.7347, 0.2653}, {0.0, 1.0}, {0.0001, -0.0770}, {0.32168, 0.33767}}; // [SMPTE ST 2065-1]
inline constexpr Primaries kAcesCg{
    {0.713, 0.293}, {0.165, 0.830}, {0.128, 0.044}, {0.32168, 0.33767}}; // [Academy S-2014-004]

// Returns whether the primaries are those of Rec. 709, within 1e-3 for the rounding in files.
bool isRec709(const Primaries& primaries);

// Matrix P diag(s) with P s = W.  [SMPTE RP 177, 3.3] Throws Error if the primaries span no colours.
Mat3<double> xyzFromRgb(const Primaries& primaries);
// Matrix from XYZ under one white to XYZ under another: von Kries scaling of Bradford's cone responses. [Lam
// 1985]
Mat3<double> adaptation(const Chromaticity& from, const Chromaticity& to);
// Matrix from linear RGB with other primaries to linear Rec. 709, white to white; the identity if isRec709().
Mat3<double> rec709From(const Primaries& primaries);

// Curve from the stored value of one channel to linear light.
struct Transfer {
  enum class Curve { linear, srgb, bt709, gamma };
  Curve curve = Curve::linear;
  double exponent = 1; // gamma: light = stored ^ exponent

  friend bool operator==(const Transfer&, const Transfer&) = default;
};
// Linear light of a stored value. Below zero, gamma is mirrored at 0; sRGB and bt709 continue the linear part
// of their curve. NaN stays NaN.
float linearised(const Transfer& transfer, float stored);

class IccTransform;

struct ColorEncoding {
  std::optional<Transfer> transfer;            // empty: the format's default (usualTransfer)
  std::optional<Primaries> primaries;          // empty: Rec. 709
  std::shared_ptr<const IccTransform> profile; // replaces transfer and primaries
};
// Description for messages: "sRGB", "gamma 2.2, Adobe RGB", "linear, other primaries", "ICC profile 'Display
// P3'".
std::string described(const ColorEncoding& encoding, const Transfer& fallback);

// Colour statement of a picture file.
struct ColorStatement {
  std::string source; // "PNG gAMA chunk"
  ColorEncoding encoding = {};
  std::string problem = {}; // not empty: what cannot be understood; `encoding` is then undefined
};

// Converts stored colours, not premultiplied, to linear Rec. 709.
class ColorDecoder {
public:
  ColorDecoder() = default; // stored values are linear Rec. 709
  // `fallback` is used if the encoding has no transfer.
  ColorDecoder(const ColorEncoding& encoding, const Transfer& fallback);

  // A profile makes channels depend on each other: then call decoded() instead of linear() and toRec709().
  const IccTransform* profile() const { return profile_.get(); }
  float linear(float stored) const {
    return transfer_.curve == Transfer::Curve::linear ? stored : linearised(transfer_, stored);
  }
  bool mixesChannels() const { return rec709_.has_value(); }
  void toRec709(float* linearRgb) const; // 3 channels, in place

  friend bool havePrimariesInCommon(const ColorDecoder& a, const ColorDecoder& b) {
    return a.rec709_ == b.rec709_;
  }

private:
  Transfer transfer_;
  std::optional<Mat3<float>> rec709_; // none: the identity
  std::shared_ptr<const IccTransform> profile_;
};

// Linear Rec. 709, 3 channels, from stored colours without alpha, 1 or 3 channels.
Image decoded(const Image& colors, const ColorDecoder& decoder);

// Linear light to 8-bit sRGB without a power function per sample.

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
