// What a single file is: a picture, a mesh, a script or a stage.
#pragma once

#include "apps/command.h"

#include <filesystem>
#include <optional>

namespace surflect {

// Contents of a picture, a mesh, or a TOML file that is a script or a stage; nothing for a folder and for a
// file of another extension. Throws Error if the file cannot be read as what its extension says.
std::optional<Json> describeFile(const std::filesystem::path& path, const Progress& progress);

} // namespace surflect
