// Folder listings. Pictures are recognised by name alone.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::importers {

// Natural order, 2 before 10: digits compare as numbers.
bool naturallyBefore(std::string_view a, std::string_view b);

// Returns whether the name is hidden: ".DS_Store", or "._photo.jpg", in which macOS keeps file attributes
// (AppleDouble).
bool isHidden(const std::filesystem::path& path);
// False if the path does not exist or cannot be accessed.
bool isFile(const std::filesystem::path& path);
bool isFolder(const std::filesystem::path& path);
// Returns whether a name is that of a mask: "mask.png", "cat.mask.png", "cat_mask.png", "cat-mask.png".
bool isMaskName(const std::filesystem::path& path);
// Pictures whose names differ from most, digits ignored: "Normal_gt.png" among "001.png", "002.png", ..; none
// if no name pattern is shared by most.
std::vector<std::string> oddNames(const std::vector<std::filesystem::path>& pictures);

// Pictures of a folder in natural order, without hidden ones. Throws Error if the folder cannot be opened.
std::vector<std::filesystem::path> picturesIn(const std::filesystem::path& folder);
// Pictures of a folder and all folders below it; links to folders are not followed. The folder may be
// missing.
std::vector<std::filesystem::path> picturesBelow(const std::filesystem::path& folder);

} // namespace surflect::importers
