// [Windows] Windows GDI, "Bitmap Header Types": BITMAPFILEHEADER (14 bytes), then BITMAPINFOHEADER,
// BITMAPV4HEADER or BITMAPV5HEADER, which begin with the same fields. Numbers are little-endian.
#include "srf/image/bmp_header.h"

#include "srf/image/icc.h"
#include "surfel/base/endian.h"
#include "surfel/base/error.h"

#include <array>
#include <cstdio>
#include <string>

namespace surflect::image {

namespace {

constexpr size_t kHeader = 14, kBits = kHeader + 14, kCompression = kHeader + 16, kMasks = kHeader + 40,
                 kColorSpace = kHeader + 56, kEndpoints = kHeader + 60, kGamma = kHeader + 96,
                 kProfile = kHeader + 112;
constexpr uint32_t kBitfields = 3, kAlphaBitfields = 6;     // values of the compression field
constexpr uint32_t kCalibrated = 0, kEmbedded = 0x4d424544, // values of the colour space field: 'MBED'
    kLinked = 0x4c494e4b;                                   // 'LINK'

std::string hex(uint32_t value) {
  char text[16];
  std::snprintf(text, sizeof text, "%08x", value);
  return text;
}

// Encoding by calibration fields: end points are XYZ of 2.30 bits, whose sum is white; gammas are 16.16 bits,
// one per channel.
ColorEncoding calibrated(std::string_view file) {
  std::array<Vec3<double>, 3> xyz;
  for (size_t c = 0; c < 3; ++c)
    for (size_t i = 0; i < 3; ++i)
      xyz[c][static_cast<int>(i)] = littleEndian(file, kEndpoints + 12 * c + 4 * i) / 1073741824.0;
  const auto at = [](const Vec3<double>& v) { return Chromaticity{v[0] / v.sum(), v[1] / v.sum()}; };
  const Primaries primaries{at(xyz[0]), at(xyz[1]), at(xyz[2]), at(xyz[0] + xyz[1] + xyz[2])};
  xyzFromRgb(primaries); // throws if they are invalid
  const uint32_t red = littleEndian(file, kGamma), green = littleEndian(file, kGamma + 4),
                 blue = littleEndian(file, kGamma + 8);
  const double exponent = red / 65536.0;
  if (red != green || red != blue || !(exponent >= 0.1 && exponent <= 10))
    throw Error::mismatch("one from 0.1 to 10", hex(red) + ", " + hex(green) + ", " + hex(blue)).at("gamma");
  return {Transfer{Transfer::Curve::gamma, exponent}, primaries, nullptr};
}

ColorEncoding embedded(std::string_view file) {
  const size_t begin = kHeader + size_t{littleEndian(file, kProfile)},
               length = littleEndian(file, kProfile + 4);
  if (begin > file.size() || length > file.size() - begin) throw Error("the profile leaves the file");
  return {{}, {}, std::make_shared<IccTransform>(file.substr(begin, length), 3)};
}

} // namespace

BmpHeader bmpHeader(std::string_view file) {
  BmpHeader header;
  if (file.size() < kMasks || !file.starts_with("BM")) return header;
  const uint32_t size = littleEndian(file, kHeader), compression = littleEndian(file, kCompression);
  const bool hasMasks = compression == kBitfields || compression == kAlphaBitfields;
  const bool hasAlphaMask = size >= 56 || compression == kAlphaBitfields;
  if (littleEndian(file, kBits, 2) == 32 && hasMasks && file.size() >= kMasks + 16) {
    const uint32_t red = littleEndian(file, kMasks), green = littleEndian(file, kMasks + 4),
                   blue = littleEndian(file, kMasks + 8),
                   alpha = hasAlphaMask ? littleEndian(file, kMasks + 12) : 0;
    if (red != 0xff0000 || green != 0xff00 || blue != 0xff || (alpha != 0 && alpha != 0xff000000))
      throw Error::mismatch("00ff0000, 0000ff00, 000000ff and ff000000 or 0",
                            hex(red) + ", " + hex(green) + ", " + hex(blue) + " and " + hex(alpha))
          .at("masks");
    header.declaresAlpha = alpha != 0;
  }
  if (size < 108 || file.size() < kHeader + size) return header;
  const uint32_t space = littleEndian(file, kColorSpace);
  const auto state = [&](const char* source, const auto& read) {
    header.color = ColorStatement{source, {}, {}};
    try {
      header.color->encoding = read();
    } catch (const Error& e) {
      header.color->problem = e.what();
    }
  };
  const bool saysEndpoints = file.substr(kEndpoints, 48).find_first_not_of('\0') != file.npos;
  if (space == kCalibrated && saysEndpoints) state("BMP endpoints", [&] { return calibrated(file); });
  if (space == kEmbedded && size >= 124) state("BMP ICC profile", [&] { return embedded(file); });
  if (space == kLinked)
    state("BMP profile", []() -> ColorEncoding { throw Error("the profile is in another file"); });
  return header;
}

} // namespace surflect::image
