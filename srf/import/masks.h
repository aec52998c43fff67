// Masks that lie beside pictures under their names, where the source does not name them itself.
//
// The mask of 01.jpg is 01.jpg.png [COLMAP FAQ, "Mask image regions"], 01.png (or another picture), mask_01,
// or either name with _mask, -mask or .mask at its end, in a folder masks/ or mask/ that has the pictures'
// folders below it; or one with such an end beside 01.jpg.
#pragma once

#include "srf/import/source.h"

#include <filesystem>
#include <string_view>
#include <vector>

namespace surflect::importers {

// The folders in `parent` that can hold masks of pictures in a folder of the given name: masks_2 for
// images_2, masks, mask. Those that exist.
std::vector<std::filesystem::path> maskFoldersIn(const std::filesystem::path& parent,
                                                 std::string_view pictures = "");

// Gives frames their masks by name and says how many, in notes; also which files of mask folders belong to no
// picture. source.maskFolders are searched, and each folder of pictures below the root. Where the source
// itself names masks, masks by name are not used, but told. A mask that pictures of several views could claim
// is not used. Throws Error for masks out of the root, unless that is allowed.
void findMasks(Source& source);

} // namespace surflect::importers
