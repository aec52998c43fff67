// [EXIF 2.3] CIPA DC-008: 4.6.5 colour space, 4.6.7 interoperability; segments and directories, as in TIFF.
// [DCF 2.0] CIPA DC-009, Annex A: R03, a picture of the optional colour space, Adobe RGB.
// [RFC 9649] WebP Image Format, 2.7: chunks.
#include "srf/image/foreign_color.h"

#include "srf/image/icc.h"
#include "surfel/base/endian.h"
#include "surfel/base/error.h"

#include <bit>

namespace surflect::image {

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

} // namespace surflect::image
