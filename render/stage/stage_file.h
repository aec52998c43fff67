// The stage file: a TOML file that says what stands in the light stage, and where its cameras and lights are.
// docs/lightstage.md lists the keys.
#pragma once

#include "render/stage/exposure.h"
#include "render/stage/material_section.h"
#include "render/stage/rig_section.h"
#include "render/stage/scene.h"
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
  std::optional<StageExposure> exposure;        // none: photographs are in floats
  std::shared_ptr<const MaterialTables> tables; // kept for `objects`
};

// What the table [scale.NAME] holds replaces what stands outside, for the scale asked for; "" asks for none.
// Throw Error naming file, field and line. A misspelt key is answered with the nearest known one.
Stage readStage(const std::filesystem::path& path, std::string_view scale = "");
Stage parseStage(std::string_view text, const std::filesystem::path& path, std::string_view scale = "");

} // namespace surflect::stage
