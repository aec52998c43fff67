// Opens the folder of a surface light field.
#pragma once

#include "render/lightfield/common/light_field_folder.h"
#include "render/lightfield/slf/field.h"
#include "surfel/base/progress.h"

#include <filesystem>
#include <memory>

namespace surflect::slf {

struct OpenedField {
  lightfield::LightFieldFolder folder;
  Field field;
  std::unique_ptr<const Textures> textures; // read from disk when asked for
};

// Reads all but the textures, whose checksum is checked. Throws Error with file and field for a folder that
// is damaged or of another format, and Cancelled.
OpenedField openField(const std::filesystem::path& folder, const Progress& progress = {});

} // namespace surflect::slf
