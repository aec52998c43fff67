// Reads the [[object]] tables of a stage file.
#pragma once

#include "render/stage/material_section.h"
#include "render/stage/stage_scene.h"
#include "render/stage/surface.h"

#include <filesystem>
#include <vector>

namespace surflect::stage {

// Surfaces from files.
struct SurfaceFile {
  Surface surface;
  uint64_t hash; // of all files that were read
};

// Reads .glb and .gltf as readGltfMesh does, and .obj and .ply with texture coordinates and normals, in the
// axes of the file and without triangles that have no area. A triangle whose normals all point to its back is
// flipped. smooth: normals and tangents are the file's, or else means over the triangles that share a vertex;
// otherwise each triangle has its own. Missing tangents run along the texture's first coordinate, or around z
// without one. Throws Error.
SurfaceFile readSurface(const std::filesystem::path& path, bool smooth);

struct ObjectList {
  std::vector<StageObject> objects; // one or more
  std::vector<uint64_t> hashes;     // of the files that were read
};

constexpr int kFewestSegments = 3, kMostSegments = 2048;

// `segments` is the default for shapes without their own. Throws Error naming the entry.
ObjectList asObjects(const scene::Entry& entry, const MaterialList& materials, int segments);

} // namespace surflect::stage
