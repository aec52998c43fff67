// JSON of the NeRF world: Blender's exporters, nerfstudio, instant-ngp, and the relighting sets with a point
// light a frame (NRHints, GS3). What our own reader knows is read by it; the rest is brought to its spelling.
#pragma once

#include "srf/import/source.h"

#include <filesystem>
#include <optional>

namespace surflect::importers {

// The description in a folder: transforms.json, or transforms_train.json; none: empty.
std::optional<std::filesystem::path> findTransforms(const std::filesystem::path& folder);

// A JSON file, or a folder with transforms.json, or with transforms_train.json, transforms_test.json and
// transforms_val.json (or _valid). Splits are those of the files, of nerfstudio's train_filenames,
// val_filenames, test_filenames, or of each frame. Validation photographs are left out, unless there are no
// test photographs: then they are these. Throws Error.
Source readTransforms(const std::filesystem::path& folderOrFile, bool allowOutside);

} // namespace surflect::importers
