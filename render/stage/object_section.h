// Reads the [[object]] tables of a stage file.
#pragma once

#include "render/stage/material_section.h"
#include "render/stage/stage_scene.h"

#include <vector>

namespace surflect::stage {

struct ObjectList {
  std::vector<StageObject> objects; // one or more
  std::vector<uint64_t> hashes;     // of the files that were read
};

constexpr int kFewestSegments = 3, kMostSegments = 2048;

// `segments` is the default for shapes without their own. Throws Error naming the entry.
ObjectList asObjects(const scene::Entry& entry, const MaterialList& materials, int segments);

} // namespace surflect::stage
