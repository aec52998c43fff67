// Finds files whose names differ from the written ones only in letter case, accents or extension.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace surflect::capture {

// Name without the differences that are easily overlooked: in lower case, Latin letters without accents,
// whether these are composed (NFC, as most systems write) or combining (NFD, as macOS writes).
std::string foldedName(std::string_view name);

// The file below `root` whose path folds to that of `written`, which does not exist; the only one at each
// step.
std::optional<std::filesystem::path> similarFile(const std::filesystem::path& root,
                                                 const std::filesystem::path& written);

// The only picture in the folder of `written` whose name is `written` with an extension; a camera raw file
// only if there is no other picture.
std::optional<std::filesystem::path> pictureCalled(const std::filesystem::path& root,
                                                   const std::filesystem::path& written);

// Name for messages: bytes that are not UTF-8 are shown as \xf6.
std::string escapedName(std::string_view name);
// Returns whether all bytes are UTF-8.
bool isUtf8(std::string_view name);

} // namespace surflect::capture
