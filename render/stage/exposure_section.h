// Reads the [exposure] section of a stage file.
#pragma once

#include "render/scene/script_fields.h"
#include "render/stage/exposure.h"

#include <filesystem>
#include <vector>

namespace surflect::stage {

struct ExposureSection {
  StageExposure camera;
  std::vector<std::filesystem::path> files; // files that were read
};

// Throws Error naming the entry.
ExposureSection asExposure(const scene::Entry& entry);

} // namespace surflect::stage
