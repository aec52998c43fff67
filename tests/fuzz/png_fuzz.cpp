#include "srf/image/png.h"
#include "tests/fuzz/fuzz.h"

#include <zlib.h>

#include <cstdlib>
#include <string>

namespace {

uint32_t bigEndian(const char* bytes) {
  uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value = value << 8 | static_cast<uint8_t>(bytes[i]);
  return value;
}

// Checksums are made right, or no damage would come past them: chunks are length, name, content, CRC.
std::string withChunkChecksums(std::string file) {
  for (size_t chunk = 8; chunk + 12 <= file.size();) {
    const size_t length = bigEndian(&file[chunk]);
    if (length > file.size() - chunk - 12) break;
    const auto crc =
        ::crc32(0, reinterpret_cast<const Bytef*>(&file[chunk + 4]), static_cast<uInt>(length + 4));
    for (size_t i = 0; i < 4; ++i) file[chunk + 8 + length + i] = static_cast<char>(crc >> (24 - 8 * i));
    chunk += length + 12;
  }
  return file;
}

} // namespace

void surflect::fuzz_png(std::string_view input) {
  const auto path = memoryFile(withChunkChecksums(std::string(input)));
  const image::PngPicture picture = image::readPng(path);
  const image::PngHeader header = image::readPngHeader(path);
  if (header.width != picture.image.width || header.height != picture.image.height) std::abort();
  if (header.bitDepth != picture.bitDepth || header.color.has_value() != picture.color.has_value())
    std::abort();
  if (picture.color && picture.color->problem.empty() && picture.image.channels % 2 == 1)
    image::decoded(picture.image, {picture.color->encoding, {}});
}
