#include "srf/model/alpha_file.h"

#include "srf/image/deflate.h"
#include "surfel/base/archive.h"
#include "surfel/base/error.h"

#include <string>

namespace surflect::model {

namespace {

constexpr size_t kDensestAlpha = 1032; // largest expansion by deflate, bytes out for each byte in

void describeAlpha(Archive& archive, std::string& levels, int width, int height) {
  archive.magic("srf alph");
  archive.constant<uint32_t>("version", 1);
  archive.constant<uint32_t>("width", static_cast<uint32_t>(width));
  archive.constant<uint32_t>("height", static_cast<uint32_t>(height));
  archive.array<char>("levels", levels, archive.left());
}

} // namespace

std::vector<std::byte> packAlpha(const codec::AlphaPlane& plane) {
  const std::vector<uint8_t> levels = plane.levels();
  const std::string stream = image::zlibStream(std::as_bytes(std::span(levels)));
  return written(stream, [&](Archive& archive, std::string& content) {
    describeAlpha(archive, content, plane.width(), plane.height());
  });
}

codec::AlphaPlane unpackAlpha(std::span<const std::byte> content, int width, int height) {
  std::string stream;
  parse(content, [&](Archive& archive) { describeAlpha(archive, stream, width, height); });
  const size_t count = static_cast<size_t>(width) * static_cast<size_t>(height);
  std::vector<uint8_t> levels(count <= kDensestAlpha * stream.size() ? count : 0);
  if (levels.empty() ||
      !image::inflatesTo(std::as_bytes(std::span(stream)), std::as_writable_bytes(std::span(levels))))
    throw Error::mismatch("a zlib stream of " + std::to_string(count) + " bytes", "other content")
        .at("levels");
  return {width, height, levels};
}

} // namespace surflect::model
