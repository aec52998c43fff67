#include "srf/capture/file_names.h"

#include "srf/image/image_file.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>

namespace surflect::capture {

namespace fs = std::filesystem;

namespace {

// Letters without accents of U+00C0 to U+017F, in lower case; ' ' where a letter has none.
constexpr std::string_view kUnaccented = "aaaaaa ceeeeiiii nooooo  uuuuy  "
                                         "aaaaaa ceeeeiiii nooooo  uuuuy y"
                                         "aaaaaaccccccccdd  eeeeeeeeeegggg"
                                         "gggghh  iiiiiiiii   jjkk llllll "
                                         "   nnnnnn   oooooo  rrrrrrssssss"
                                         "sstttt  uuuuuuuuuuuuwwyyyzzzzzz ";
static_assert(kUnaccented.size() == 0x180 - 0xc0);

// Length of the UTF-8 sequence at the beginning; 0 if there is none.
size_t sequenceLength(std::string_view text) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const size_t length = byte(0) < 0x80                       ? 1
                        : byte(0) >= 0xc2 && byte(0) <= 0xdf ? 2
                        : byte(0) >= 0xe0 && byte(0) <= 0xef ? 3
                        : byte(0) >= 0xf0 && byte(0) <= 0xf4 ? 4
                                                             : 0;
  if (length > text.size()) return 0;
  for (size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xc0) != 0x80) return 0;
  return length;
}

uint32_t twoByteCode(std::string_view sequence) {
  return (static_cast<uint32_t>(sequence[0]) & 0x1f) << 6 | (static_cast<uint32_t>(sequence[1]) & 0x3f);
}

// Entries of a folder that `isLike` holds for; the only one, or none.
std::optional<fs::path> onlyEntry(const fs::path& folder, const auto& isLike) {
  std::optional<fs::path> found;
  std::error_code failure;
  for (fs::directory_iterator entry(folder, failure), end; !failure && entry != end;
       entry.increment(failure)) {
    if (!isLike(entry->path())) continue;
    if (found) return std::nullopt;
    found = entry->path();
  }
  return found;
}

} // namespace

std::string foldedName(std::string_view name) {
  std::string folded;
  while (!name.empty()) {
    const size_t length = std::max<size_t>(1, sequenceLength(name));
    const std::string_view sequence = name.substr(0, length);
    name.remove_prefix(length);
    if (length == 1) {
      const char c = sequence[0];
      folded += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
      continue;
    }
    const uint32_t code = length == 2 ? twoByteCode(sequence) : 0;
    if (code >= 0x300 && code < 0x370) continue; // a combining accent
    const char letter = code >= 0xc0 && code < 0x180 ? kUnaccented[code - 0xc0] : ' ';
    if (letter == ' ')
      folded += sequence;
    else
      folded += letter;
  }
  return folded;
}

std::optional<fs::path> similarFile(const fs::path& root, const fs::path& written) {
  fs::path found;
  for (const fs::path& part : written) {
    std::error_code failure;
    if (fs::exists(root / found / part, failure)) {
      found /= part;
      continue;
    }
    const std::string wanted = foldedName(part.string());
    const auto entry = onlyEntry(
        root / found, [&](const fs::path& path) { return foldedName(path.filename().string()) == wanted; });
    if (!entry) return std::nullopt;
    found /= entry->filename();
  }
  std::error_code failure;
  const bool isOther = found != written && fs::is_regular_file(root / found, failure);
  return isOther ? std::optional(found) : std::nullopt;
}

std::optional<fs::path> pictureCalled(const fs::path& root, const fs::path& written) {
  std::vector<fs::path> pictures;
  std::error_code failure;
  for (fs::directory_iterator entry(root / written.parent_path(), failure), end; !failure && entry != end;
       entry.increment(failure))
    if (entry->path().stem() == written.filename() && image::isPictureName(entry->path()))
      pictures.push_back(entry->path());
  image::removeDevelopedRaw(pictures);
  return pictures.size() == 1 ? std::optional(written.parent_path() / pictures[0].filename()) : std::nullopt;
}

bool isUtf8(std::string_view name) {
  while (!name.empty()) {
    const size_t length = sequenceLength(name);
    if (length == 0) return false;
    name.remove_prefix(length);
  }
  return true;
}

std::string escapedName(std::string_view name) {
  std::string shown;
  while (!name.empty()) {
    const size_t length = sequenceLength(name);
    if (length > 0) {
      shown += name.substr(0, length);
    } else {
      std::array<char, 8> hex{};
      std::snprintf(hex.data(), hex.size(), "\\x%02x", static_cast<unsigned char>(name[0]));
      shown += hex.data();
    }
    name.remove_prefix(std::max<size_t>(1, length));
  }
  return shown;
}

} // namespace surflect::capture
