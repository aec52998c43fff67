// JSON of NeRF programs: Blender's exporters, nerfstudio, instant-ngp, and relighting sets with a point light
// per frame (NRHints, GS3). Their keys are renamed to ours and read by readCapture.
#pragma once

#include "srf/import/foreign_capture.h"

#include <filesystem>
#include <optional>

namespace surflect::importers {

// Description in a folder: transforms.json or transforms_train.json; empty if there is none.
std::optional<std::filesystem::path> findTransforms(const std::filesystem::path& folder);

// Reads a JSON file, or a folder with transforms.json, or one with transforms_train.json,
// transforms_test.json and transforms_val.json (or _valid). Splits are those of the files, of nerfstudio's
// train_filenames, val_filenames, test_filenames, or of each frame. Validation photographs are dropped, or
// become the test if there is none. Throws Error.
ForeignCapture readTransforms(const std::filesystem::path& folderOrFile, bool allowOutside);

} // namespace surflect::importers
