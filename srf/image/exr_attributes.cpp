// [OpenEXR] OpenEXR File Layout: after magic number and version, each header is a list of attributes (name,
// type, size, value) that ends with an empty name; a file of several parts ends its list of headers with an
// empty one. Texts end with a zero byte, numbers are little-endian.
#include "srf/image/exr_attributes.h"

#include "surfel/base/endian.h"
#include "surfel/base/error.h"

#include <ImfVersion.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace surflect::image {

namespace {

const std::map<std::string_view, int64_t> kSizes = {{"box2f", 16},
                                                    {"box2i", 16},
                                                    {"chromaticities", 32},
                                                    {"compression", 1},
                                                    {"deepImageState", 1},
                                                    {"double", 8},
                                                    {"envmap", 1},
                                                    {"float", 4},
                                                    {"int", 4},
                                                    {"keycode", 28},
                                                    {"lineOrder", 1},
                                                    {"m33d", 72},
                                                    {"m33f", 36},
                                                    {"m44d", 128},
                                                    {"m44f", 64},
                                                    {"rational", 8},
                                                    {"tiledesc", 9},
                                                    {"timecode", 8},
                                                    {"v2d", 16},
                                                    {"v2f", 8},
                                                    {"v2i", 8},
                                                    {"v3d", 24},
                                                    {"v3f", 12},
                                                    {"v3i", 12}};

// End of the channel list that begins with `value`: each entry is a name and 16 bytes, the last name is
// empty.
std::optional<int64_t> endOfChannels(std::string_view value) {
  for (size_t at = 0; at < value.size();) {
    const size_t end = value.find('\0', at);
    if (end == value.npos) return std::nullopt;
    if (end == at) return static_cast<int64_t>(end + 1);
    at = end + 1 + 16;
  }
  return std::nullopt;
}

// End of the last text; each text is preceded by its length.
std::optional<int64_t> endOfTexts(std::string_view value) {
  size_t at = 0;
  while (at + 4 <= value.size()) at += 4 + size_t{littleEndian(value, at)};
  return static_cast<int64_t>(at);
}

// Size of a preview: width and height, then pixels of 4 bytes.
int64_t sizeOfPreview(std::string_view value) {
  if (value.size() < 8) return 8;
  constexpr int64_t kMostSide = int64_t{1} << 24;
  return 8 + 4 * std::min<int64_t>(littleEndian(value, 0), kMostSide) *
                 std::min<int64_t>(littleEndian(value, 4), kMostSide);
}

// Size that the type requires; empty if any size is valid, or none.
std::optional<int64_t> sizeOf(std::string_view type, std::string_view value) {
  if (const auto found = kSizes.find(type); found != kSizes.end()) return found->second;
  if (type == "chlist") return endOfChannels(value).value_or(-1);
  if (type == "stringvector") return endOfTexts(value);
  if (type == "preview") return sizeOfPreview(value);
  return std::nullopt;
}

} // namespace

void requireHonestAttributes(const std::filesystem::path& path) {
  constexpr int64_t kLongestWord = 255;
  std::ifstream in(path, std::ios::binary);
  const auto bytes = static_cast<int64_t>(std::filesystem::file_size(path));
  std::array<char, 8> magicAndVersion{};
  in.read(magicAndVersion.data(), magicAndVersion.size());
  if (!in || !Imf::isImfMagic(magicAndVersion.data())) return;
  const auto word = [&]() -> std::optional<std::string> {
    std::array<char, kLongestWord + 1> text;
    if (!in.getline(text.data(), text.size(), '\0')) return std::nullopt;
    return text.data();
  };
  constexpr unsigned kIsMultiPart = 0x10; // in the second byte of the version
  const bool hasSeveralHeaders = static_cast<unsigned char>(magicAndVersion[5]) & kIsMultiPart;
  for (bool isLast = false; !isLast;) {
    isLast = true; // true unless it is a non-empty header of several
    for (auto name = word(); name && !name->empty(); name = word()) {
      isLast = !hasSeveralHeaders;
      const auto type = word();
      std::array<char, 4> size{};
      if (!type || !in.read(size.data(), size.size())) return;
      const int64_t length = littleEndian({size.data(), size.size()}, 0), left = bytes - in.tellg();
      const auto refuse = [&](const std::string& expected) {
        throw Error::mismatch(expected, std::to_string(length) + " bytes of " + *type).at(*name).in(path);
      };
      if (length > left) refuse("at most the " + std::to_string(left) + " that are left of the file");
      std::string value(static_cast<size_t>(length), '\0');
      in.read(value.data(), length);
      const auto expected = sizeOf(*type, value);
      if (expected && *expected != length)
        refuse(*expected < 0 ? "an end of the list in them" : std::to_string(*expected) + " bytes");
    }
  }
}

} // namespace surflect::image
