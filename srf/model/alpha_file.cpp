#include "srf/model/alpha_file.h"

#include "srf/image/deflate.h"
#include "surfel/base/endian.h"
#include "surfel/base/error.h"

#include <fmt/format.h>
#include <libdeflate.h>

#include <memory>
#include <new>
#include <span>
#include <vector>

namespace surflect::model {

namespace {

constexpr std::string_view kAlphaMagic = "srf alph";
constexpr uint32_t kAlphaFileVersion = 1;
constexpr size_t kAlphaHeader = 20;    // bytes: magic, version, width, height
constexpr size_t kDensestAlpha = 1032; // largest expansion by deflate, bytes out for each byte in

void appendLittleEndian(std::string& bytes, uint32_t value) {
  for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<char>(value >> 8 * i & 0xff));
}

struct FreeDecompressor {
  void operator()(libdeflate_decompressor* held) const { ::libdeflate_free_decompressor(held); }
};

// Inflates a stream; returns whether it holds exactly as many bytes as `out`.
bool inflatesTo(std::string_view stream, std::span<uint8_t> out) {
  const std::unique_ptr<libdeflate_decompressor, FreeDecompressor> decompressor(
      ::libdeflate_alloc_decompressor());
  if (!decompressor) throw std::bad_alloc();
  size_t read = 0, written = 0;
  const libdeflate_result result = ::libdeflate_zlib_decompress_ex(
      decompressor.get(), stream.data(), stream.size(), out.data(), out.size(), &read, &written);
  return result == LIBDEFLATE_SUCCESS && read == stream.size() && written == out.size();
}

} // namespace

std::string packAlpha(const codec::AlphaPlane& plane) {
  std::string bytes(kAlphaMagic);
  appendLittleEndian(bytes, kAlphaFileVersion);
  appendLittleEndian(bytes, static_cast<uint32_t>(plane.width()));
  appendLittleEndian(bytes, static_cast<uint32_t>(plane.height()));
  const std::vector<uint8_t> levels = plane.levels();
  return bytes + image::zlibStream(std::as_bytes(std::span(levels)));
}

codec::AlphaPlane unpackAlpha(std::string_view content, int width, int height) {
  if (content.size() < kAlphaHeader)
    throw Error::mismatch(fmt::format("at least {} bytes", kAlphaHeader),
                          fmt::format("{} bytes", content.size()))
        .at("size");
  if (!content.starts_with(kAlphaMagic)) throw Error::mismatch("'srf alph'", "other bytes").at("magic");
  if (const uint32_t version = littleEndian(content, 8); version != kAlphaFileVersion)
    throw Error::mismatch(std::to_string(kAlphaFileVersion), std::to_string(version)).at("version");
  const std::string expected = fmt::format("{} x {} pixels", width, height),
                    found =
                        fmt::format("{} x {} pixels", littleEndian(content, 12), littleEndian(content, 16));
  if (found != expected) throw Error::mismatch(expected, found).at("size");
  const std::string_view stream = content.substr(kAlphaHeader);
  const size_t count = static_cast<size_t>(width) * static_cast<size_t>(height);
  std::vector<uint8_t> levels(count <= kDensestAlpha * stream.size() ? count : 0);
  if (levels.empty() || !inflatesTo(stream, levels))
    throw Error::mismatch(fmt::format("a zlib stream of {} bytes", count), "other content").at("levels");
  return {width, height, levels};
}

} // namespace surflect::model
