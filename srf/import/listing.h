// Listings of folders. Pictures are told by their names alone.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::importers {

// In lower case, ASCII letters only.
std::string lowered(std::string text);

// 2 before 10: digits compare as numbers.
bool naturallyBefore(std::string_view a, std::string_view b);

// ".DS_Store", or "._photo.jpg", in which macOS keeps a file's attributes where the file system has no room
// for them (AppleDouble).
bool isHidden(const std::filesystem::path& path);
// False where there is nothing, and where it cannot be looked at.
bool isFile(const std::filesystem::path& path);
bool isFolder(const std::filesystem::path& path);
// "mask.png", "cat.mask.png", "cat_mask.png", "cat-mask.png".
bool isMaskName(const std::filesystem::path& path);
// Pictures that are called otherwise than most, digits apart: "Normal_gt.png" among "001.png", "002.png", ..;
// none where most have no name in common.
std::vector<std::string> oddNames(const std::vector<std::filesystem::path>& pictures);

// The pictures of a folder, hidden ones left out, in natural order. Throws Error if it cannot be opened.
std::vector<std::filesystem::path> picturesIn(const std::filesystem::path& folder);
// Pictures of a folder that need not be there, with all folders below it. Links to folders are not followed.
std::vector<std::filesystem::path> picturesBelow(const std::filesystem::path& folder);

} // namespace surflect::importers
