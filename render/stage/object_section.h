// The objects of a stage file: its [[object]] tables.
#pragma once

#include "render/stage/material_section.h"
#include "render/stage/scene.h"

#include <vector>

namespace surflect::stage {

struct ObjectList {
  std::vector<StageObject> objects; // one or more
  std::vector<uint64_t> hashes;     // of what was read for them
};

constexpr int kFewestSegments = 3, kMostSegments = 2048;

// `segments` is for shapes that do not say how many they have. Throws Error naming the entry.
ObjectList asObjects(const scene::Entry& entry, const MaterialList& materials, int segments);

} // namespace surflect::stage
