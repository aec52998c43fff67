#include "render/lightfield/slf/texture_file.h"

#include "render/lightfield/common/read_at.h"
#include "surfel/base/error.h"

#include <algorithm>
#include <cassert>
#include <cerrno>
#include <cstring>
#include <string>
#include <sys/stat.h>
#include <unistd.h>

namespace surflect::slf {

namespace {

bool isFinite(const Texel& texel) {
  constexpr uint16_t kExponent = 0x7c00;
  return std::ranges::none_of(texel, [](uint16_t half) { return (half & kExponent) == kExponent; });
}

} // namespace

TextureFile::TextureFile(std::filesystem::path path)
    : path_(std::move(path)), descriptor_(openForReading(path_)) {
  struct stat status {};
  const bool isKnown = ::fstat(descriptor_, &status) == 0;
  const auto bytes = static_cast<uint64_t>(status.st_size);
  if (!isKnown || bytes % sizeof(Texel) != 0) {
    ::close(descriptor_);
    throw Error::mismatch("a multiple of " + std::to_string(sizeof(Texel)), std::to_string(bytes) + " bytes")
        .at("size")
        .in(path_);
  }
  texels_ = bytes / sizeof(Texel);
}

TextureFile::~TextureFile() { ::close(descriptor_); }

void TextureFile::place(TexturePlaces places, std::vector<size_t> sizes) {
  assert(places.size() == sizes.size());
  places_ = std::move(places);
  sizes_ = std::move(sizes);
}

std::vector<Texel> TextureFile::read(size_t region, size_t direction) const {
  std::vector<Texel> texels(sizes_[region]); // black
  const uint64_t place = places_[region][direction];
  if (place == kNotStored) return texels;
  const auto field = [&] {
    return "texture " + std::to_string(direction) + " of region " + std::to_string(region);
  };
  try {
    lightfield::readAt(descriptor_, std::as_writable_bytes(std::span(texels)), place * sizeof(Texel));
  } catch (Error& error) {
    throw std::move(error).at(field()).in(path_);
  }
  if (!std::ranges::all_of(texels, isFinite))
    throw Error("has a texel that is not finite").at(field()).in(path_);
  return texels;
}

} // namespace surflect::slf
