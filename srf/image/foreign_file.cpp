#include "srf/image/foreign_file.h"

#include "srf/image/icc.h"
#include "surfel/base/error.h"
#include "surfel/base/file.h"

#include <array>
#include <bit>
#include <cstdio>
#include <string>

namespace surflect::image {

// [Windows] Windows GDI, "Bitmap Header Types": BITMAPFILEHEADER (14 bytes), then BITMAPINFOHEADER,
// BITMAPV4HEADER or BITMAPV5HEADER, which begin with the same fields. Numbers are little-endian.
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

// [EXIF 2.3] CIPA DC-008: 4.6.5 colour space, 4.6.7 interoperability; segments and directories, as in TIFF.
// [DCF 2.0] CIPA DC-009, Annex A: R03, a picture of the optional colour space, Adobe RGB.
// [RFC 9649] WebP Image Format, 2.7: chunks.
namespace {

// Numbers at arbitrary offsets of a file, in either byte order; 0 beyond its end.
class Numbers {
public:
  explicit Numbers(std::string_view bytes, std::endian order) : bytes_(bytes), order_(order) {}

  uint32_t at(size_t place, size_t count) const {
    if (place > bytes_.size() || count > bytes_.size() - place) return 0;
    return order_ == std::endian::big ? bigEndian(bytes_, place, count) : littleEndian(bytes_, place, count);
  }
  std::string_view bytes() const { return bytes_; }

private:
  std::string_view bytes_;
  std::endian order_;
};

// Offset of a tag's entry in the directory at an offset.
std::optional<size_t> entryOf(const Numbers& tiff, size_t directory, uint32_t tag) {
  const uint32_t entries = tiff.at(directory, 2);
  for (uint32_t i = 0; i < entries; ++i)
    if (const size_t entry = directory + 2 + 12 * size_t{i}; tiff.at(entry, 2) == tag) return entry;
  return std::nullopt;
}

// Content after "Exif" in the APP1 segment; empty if there is none. A segment is a marker and a length.
std::string_view exifOf(std::string_view jpeg) {
  constexpr uint32_t kApp1 = 0xffe1, kStartOfScan = 0xffda;
  constexpr std::string_view kName("Exif\0\0", 6);
  const Numbers file(jpeg, std::endian::big);
  for (size_t at = 2; at + 4 <= jpeg.size();) {
    const uint32_t marker = file.at(at, 2), length = file.at(at + 2, 2);
    if (marker < 0xff00 || marker == kStartOfScan || length < 2) break;
    const std::string_view content = jpeg.substr(at + 4, length - 2);
    if (marker == kApp1 && content.starts_with(kName)) return content.substr(kName.size());
    at += 2 + size_t{length};
  }
  return {};
}

} // namespace

ColorStatement profileStatement(std::string source, std::string_view profile, int channels) {
  ColorStatement statement{std::move(source), {}, {}};
  try {
    statement.encoding.profile = std::make_shared<IccTransform>(profile, channels);
  } catch (const Error& e) {
    statement.problem = e.what();
  }
  return statement;
}

std::optional<ColorStatement> exifColorStatement(std::string_view jpeg) {
  constexpr uint32_t kExif = 0x8769, kColorSpace = 0xa001, kInteroperability = 0xa005, kIndex = 1;
  constexpr uint32_t kSrgb = 1, kAdobe = 2, kUncalibrated = 0xffff; // 2 is not in EXIF, but in use
  const std::string_view exif = exifOf(jpeg);
  if (exif.size() < 8) return std::nullopt;
  const Numbers tiff(exif, exif.starts_with("MM") ? std::endian::big : std::endian::little);
  const auto directoryOf = [&](size_t outer, uint32_t tag) -> std::optional<size_t> {
    const auto entry = entryOf(tiff, outer, tag);
    return entry ? std::optional<size_t>(tiff.at(*entry + 8, 4)) : std::nullopt;
  };
  const auto directory = directoryOf(tiff.at(4, 4), kExif);
  const auto entry = directory ? entryOf(tiff, *directory, kColorSpace) : std::nullopt;
  if (!entry) return std::nullopt;
  const uint32_t space = tiff.at(*entry + 8, 2);
  const auto interoperability = directoryOf(*directory, kInteroperability);
  const auto index = interoperability ? entryOf(tiff, *interoperability, kIndex) : std::nullopt;
  const bool isR03 = index && Numbers(exif, std::endian::big).at(*index + 8, 3) == 0x523033; // ASCII
  if (space == kSrgb && !isR03)
    return ColorStatement{"EXIF", {Transfer{Transfer::Curve::srgb}, kRec709, nullptr}, {}};
  if (space == kAdobe || isR03) // gamma 2 + 51/256  [Adobe RGB 1998, 4.3.1.2]
    return ColorStatement{
        "EXIF, Adobe RGB", {Transfer{Transfer::Curve::gamma, 2 + 51. / 256}, kAdobeRgb, nullptr}, {}};
  if (space == kUncalibrated) return ColorStatement{"EXIF says uncalibrated, no profile", {}, {}};
  return std::nullopt;
}

std::string_view webpProfile(std::string_view file) {
  const Numbers numbers(file, std::endian::little);
  if (!file.starts_with("RIFF")) return {};
  for (size_t at = 12; at + 8 <= file.size();) {
    const size_t length = numbers.at(at + 4, 4);
    if (file.substr(at, 4) == "ICCP") return file.substr(at + 8, length);
    at += 8 + length + length % 2;
  }
  return {};
}

std::string jpegDamage(std::string_view file) {
  constexpr uint32_t kStart = 0xffd8, kEnd = 0xffd9, kStartOfScan = 0xffda, kFirstRestart = 0xffd0,
                     kLastRestart = 0xffd7;
  const Numbers numbers(file, std::endian::big);
  if (numbers.at(0, 2) != kStart) return {}; // the decoder's matter
  const auto hasNoLength = [](uint32_t marker) { return marker >= kFirstRestart && marker <= kLastRestart; };
  bool inScan = false;
  for (size_t at = 2; at + 2 <= file.size();) {
    if (inScan) { // a marker is 0xff with another byte than 0, which stands for the 0xff itself
      at = file.find('\xff', at);
      if (at == file.npos || at + 2 > file.size()) break;
    }
    const uint32_t marker = numbers.at(at, 2);
    if (marker == kEnd) return {};
    if (marker == 0xffff) { // filling
      ++at;
    } else if (inScan && (marker == 0xff00 || hasNoLength(marker))) {
      at += 2;
    } else if (marker < 0xff00) {
      return {}; // the decoder's matter
    } else if (at + 4 > file.size()) {
      break;
    } else {
      inScan = marker == kStartOfScan;
      at += 2 + size_t{numbers.at(at + 2, 2)};
    }
  }
  return "the file ends before its picture";
}

std::string webpDamage(std::string_view file) {
  constexpr size_t kZeros = 64;
  const Numbers numbers(file, std::endian::little);
  if (!file.starts_with("RIFF")) return {};
  for (size_t at = 12; at + 8 <= file.size();) {
    const size_t length = numbers.at(at + 4, 4);
    const std::string_view name = file.substr(at, 4);
    if (name == "VP8 " || name == "VP8L")
      if (const size_t zeros = file.substr(at + 8, length).find(std::string(kZeros, '\0'));
          zeros != file.npos)
        return "its pixels are zeros from byte " + std::to_string(at + 8 + zeros) + " on";
    at += 8 + length + length % 2;
  }
  return {};
}

namespace {

// Returns whether a fourth byte is alpha. If the header does not declare it, or it is 0 everywhere, it is
// alpha only if it varies: programs write alpha without declaring it, but cameras and screen captures leave
// the byte undefined.
bool isAlpha(const Image& image, bool declared) {
  const float first = image.values[3];
  bool varies = false;
  for (size_t i = 3; i < image.values.size() && !varies; i += 4) varies = image.values[i] != first;
  return varies || (declared && first > 0);
}

Image withoutAlpha(const Image& image) {
  Image opaque(image.width, image.height, 3);
  for (size_t i = 0; i < opaque.values.size(); ++i) opaque.values[i] = image.values[i / 3 * 4 + i % 3];
  return opaque;
}

// Drops the fourth channel unless it is alpha; does nothing if only the header was read.
void keepOnlyAlpha(Image& image, bool declared) {
  if (image.channels == 4 && !image.values.empty() && !isAlpha(image, declared)) image = withoutAlpha(image);
}

// [Truevision TGA 2.0, field 24] attribute types: 0 no alpha, 1 and 2 undefined, 3 straight, 4 premultiplied.
// Without an extension area the header's alpha bits declare alpha, which OpenImageIO then calls straight.
void settleTargaAlpha(Picture& picture, int type, bool calledStraight) {
  constexpr int kIgnored = 1, kRetained = 2, kPremultiplied = 4;
  picture.alphaPremultiplied = type == kPremultiplied;
  if (picture.image.channels == 4 && (type == kIgnored || type == kRetained)) {
    if (picture.image.values.empty())
      picture.image.channels = 3;
    else
      picture.image = withoutAlpha(picture.image);
  }
  keepOnlyAlpha(picture.image, calledStraight || type == kPremultiplied);
}

} // namespace

Picture completed(ForeignPicture read, const std::filesystem::path& path, std::string_view extension) {
  constexpr size_t kExifEnds = size_t{1} << 18; // EXIF's segment is an early one, of at most 2^16 bytes
  Picture picture{std::move(read.image), read.bits, read.alphaPremultiplied, {}, read.orientation};
  const int channels = picture.image.channels >= 3 ? 3 : 1;
  const bool isJpeg = extension == ".jpg" || extension == ".jpeg" || extension == ".jpe";
  if (!read.iccProfile.empty())
    picture.color =
        profileStatement(isJpeg ? "JPEG ICC profile" : "TIFF ICC profile", read.iccProfile, channels);
  else if (isJpeg)
    picture.color = exifColorStatement(readFileStart(path, kExifEnds));
  if (extension == ".webp") {
    const std::string file = readFile(path);
    if (const auto profile = webpProfile(file); !profile.empty())
      picture.color = profileStatement("WebP ICC profile", profile, channels);
  }
  if (extension == ".tga") settleTargaAlpha(picture, read.targaAlphaType, !read.alphaPremultiplied);
  if (extension == ".bmp") try {
      const BmpHeader header = bmpHeader(readFile(path));
      picture.color = header.color;
      picture.alphaPremultiplied = false;
      keepOnlyAlpha(picture.image, header.declaresAlpha);
    } catch (Error& e) {
      throw std::move(e).in(path);
    }
  return picture;
}

} // namespace surflect::image
