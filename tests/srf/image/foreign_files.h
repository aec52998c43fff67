// Small JPEG, TIFF, BMP, Targa and Radiance files, made byte by byte.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace surflect::image {

inline std::string littleEndianBytes(uint32_t value, size_t count = 4) {
  std::string bytes;
  for (size_t i = 0; i < count; ++i) bytes += static_cast<char>(value >> 8 * i & 0xff);
  return bytes;
}

inline std::string jpegSegment(char marker, const std::string& content) {
  const size_t length = content.size() + 2;
  return std::string("\xff") + marker + static_cast<char>(length >> 8) + static_cast<char>(length & 0xff) +
         content;
}

// 16 x 8 pixels of gray, two blocks: 128 and 192; with segments before them.
inline std::string grayJpeg(const std::string& segments) {
  using namespace std::string_literals;
  std::string file = "\xff\xd8"s + segments + jpegSegment('\xdb', '\0' + std::string(64, '\x08'));
  file += jpegSegment('\xc0', "\x08\0\x08\0\x10\x01\x01\x11\0"s);
  file +=
      jpegSegment('\xc4', "\0\0\x02"s + std::string(14, '\0') + "\0\x07"s); // 00: no difference; 01: 7 bits
  file += jpegSegment('\xc4', "\x10\x01"s + std::string(15, '\0') + "\0"s); // 0: the end of a block
  file += jpegSegment('\xda', "\x01\x01\0\0\x3f\0"s) + "\x0c\x07\xff\xd9"s;
  return file;
}

// EXIF of a colour space and, unless it is empty, an interoperability index; in little-endian order, "II", or
// big-endian order, "MM".
inline std::string exifSegment(uint32_t colorSpace, const std::string& index,
                               const std::string& order = "II") {
  const auto number = [&](uint32_t value, size_t count) {
    const std::string bytes = littleEndianBytes(value, count);
    return order == "II" ? bytes : std::string(bytes.rbegin(), bytes.rend());
  };
  const auto entry = [&](uint32_t tag, uint32_t type, const std::string& value) {
    return number(tag, 2) + number(type, 2) + number(1, 4) + value;
  };
  const std::string end = number(0, 4); // no further directory
  std::string tiff = order + number(42, 2) + number(8, 4);
  tiff += number(1, 2) + entry(0x8769, 4, number(26, 4)) + end;
  tiff += number(2, 2) + entry(0xa001, 3, number(colorSpace, 2) + number(0, 2)) +
          entry(0xa005, 4, number(56, 4)) + end;
  tiff += number(index.empty() ? 0 : 1, 2);
  if (!index.empty()) tiff += entry(1, 2, index + '\0');
  return jpegSegment('\xe1', std::string("Exif\0\0", 6) + tiff + end);
}

struct TiffOf {
  uint32_t width = 1, height = 1, bits = 8, channels = 3, photometric = 2;
  uint32_t extraSample = 0; // 1 premultiplied alpha, 2 straight; 0: there is none
  std::string pixels, iccProfile = {};
};

inline std::string tiffFile(const TiffOf& tiff) {
  struct Entry {
    uint32_t type, count; // 3: 16 bits, 4: 32 bits, 7: bytes
    std::string value;
  };
  std::string depths, pixels = tiff.pixels;
  for (uint32_t c = 0; c < tiff.channels; ++c) depths += littleEndianBytes(tiff.bits, 2);
  const auto word = [](uint32_t value) { return Entry{4, 1, littleEndianBytes(value)}; };
  const auto bytes = static_cast<uint32_t>(pixels.size());
  std::map<uint32_t, Entry> entries{{256, word(tiff.width)},
                                    {257, word(tiff.height)},
                                    {258, {3, tiff.channels, depths}},
                                    {259, word(1)},
                                    {262, {3, 1, littleEndianBytes(tiff.photometric)}},
                                    {273, word(8)},
                                    {277, {3, 1, littleEndianBytes(tiff.channels)}},
                                    {278, word(tiff.height)},
                                    {279, word(bytes)}};
  if (tiff.extraSample) entries[338] = {3, 1, littleEndianBytes(tiff.extraSample)};
  if (!tiff.iccProfile.empty())
    entries[34675] = {7, static_cast<uint32_t>(tiff.iccProfile.size()), tiff.iccProfile};
  // Header and pixels, the directory, then values that do not fit into it.
  if (pixels.size() % 2 == 1) pixels += '\0';
  const uint32_t directory = 8 + static_cast<uint32_t>(pixels.size());
  uint32_t place = directory + 2 + 12 * static_cast<uint32_t>(entries.size()) + 4;
  std::string table = littleEndianBytes(static_cast<uint32_t>(entries.size()), 2), far;
  for (const auto& [tag, entry] : entries) {
    table += littleEndianBytes(tag, 2) + littleEndianBytes(entry.type, 2) + littleEndianBytes(entry.count);
    if (entry.value.size() <= 4) {
      table += entry.value + std::string(4 - entry.value.size(), '\0');
      continue;
    }
    table += littleEndianBytes(place + static_cast<uint32_t>(far.size()));
    far += entry.value + std::string(entry.value.size() % 2, '\0');
  }
  return "II" + littleEndianBytes(42, 2) + littleEndianBytes(directory) + pixels + table +
         littleEndianBytes(0) + far;
}

// 32 bits a pixel, blue first, one row; of BITMAPINFOHEADER (40) or BITMAPV4HEADER (108) with masks.
inline std::string bmpFile(uint32_t headerSize, const std::string& pixels, uint32_t alphaMask = 0xff000000,
                           uint32_t redMask = 0xff0000) {
  const auto bytes = static_cast<uint32_t>(pixels.size());
  std::string header = littleEndianBytes(headerSize) + littleEndianBytes(bytes / 4) + littleEndianBytes(1) +
                       littleEndianBytes(1, 2) + littleEndianBytes(32, 2) +
                       littleEndianBytes(headerSize > 40 ? 3 : 0) + littleEndianBytes(bytes) +
                       std::string(16, '\0');
  if (headerSize > 40)
    header += littleEndianBytes(redMask) + littleEndianBytes(0xff00) + littleEndianBytes(0xff) +
              littleEndianBytes(alphaMask) + "BGRs";
  header.resize(headerSize);
  return "BM" + littleEndianBytes(14 + headerSize + bytes) + littleEndianBytes(0) +
         littleEndianBytes(14 + headerSize) + header + pixels;
}

// 32 bits a pixel, blue first, one row from the top; so many bits of alpha by its header, and an extension
// area with a type of alpha where one is given.
inline std::string targaFile(int alphaBits, const std::string& pixels, std::optional<int> type = {}) {
  std::string file(18, '\0');
  file[2] = 2; // true colour, not packed
  file[12] = static_cast<char>(pixels.size() / 4), file[14] = 1;
  file[16] = 32, file[17] = static_cast<char>(0x20 | alphaBits);
  file += pixels;
  if (!type) return file;
  std::string extension = littleEndianBytes(495, 2) + std::string(493, '\0'); // its length comes first
  extension[494] = static_cast<char>(*type);
  const auto place = static_cast<uint32_t>(file.size());
  return file + extension + littleEndianBytes(place) + littleEndianBytes(0) +
         std::string("TRUEVISION-XFILE.\0", 18);
}

// One pixel of mantissas and exponent, after header lines that each end with a line feed.
inline std::string radianceFile(const std::string& lines, const std::string& pixel,
                                const std::string& format = "32-bit_rle_rgbe") {
  return "#?RADIANCE\n" + lines + "FORMAT=" + format + "\n\n-Y 1 +X 1\n" + pixel;
}

} // namespace surflect::image
