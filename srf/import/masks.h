// Masks that are found by name, where the source does not name them.
//
// The mask of 01.jpg is 01.jpg.png [COLMAP FAQ, "Mask image regions"], 01.png (or another format), mask_01,
// or either name with the suffix _mask, -mask or .mask, in a folder masks/ or mask/ with the pictures'
// subfolders; or one with such a suffix beside 01.jpg. A mask of a camera's name in masks/ or mask/ is that
// of all its photographs without one.
#pragma once

#include "srf/import/foreign_capture.h"

#include <filesystem>
#include <string_view>
#include <vector>

namespace surflect::importers {

// Existing folders of `parent` that can hold masks of pictures in a folder of the given name: masks_2 for
// images_2, masks, mask.
std::vector<std::filesystem::path> maskFoldersIn(const std::filesystem::path& parent,
                                                 std::string_view pictures = "");

// Assigns masks to frames by name, and notes how many, and mask files that belong to no picture. Searches
// source.maskFolders and each folder of pictures below the root. If the source names masks itself, masks by
// name are not used, with a note. A mask whose name fits pictures of several views is not used. Throws Error
// for masks outside of the root, unless allowed.
void findMasks(ForeignCapture& source);

} // namespace surflect::importers
