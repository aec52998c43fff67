// The stage file: TOML description of the light stage's objects, cameras and lights. docs/lightstage.md lists
// the keys.
#pragma once

#include "render/stage/exposure.h"
#include "render/stage/material_section.h"
#include "render/stage/rig.h"
#include "render/stage/stage_scene.h"
#include "render/stage/tracer.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

namespace surflect::stage {

struct Stage {
  std::filesystem::path file;
  uint64_t hash = 0; // of the text, and of the files that it names
  std::vector<StageObject> objects;
  StageRig rig;
  TraceOptions trace;
  std::optional<StageExposure> exposure;        // none: photographs are floats
  std::shared_ptr<const MaterialTables> tables; // keeps the tables of `objects` alive
};

// Reads a stage file. If `scale` is not "", the keys of the table [scale.NAME] with this name override those
// of the rest of the file. Throw Error with file, field and line; for an unknown key, with the nearest known
// one.
Stage readStage(const std::filesystem::path& path, std::string_view scale = "");
Stage parseStage(std::string_view text, const std::filesystem::path& path, std::string_view scale = "");

} // namespace surflect::stage
