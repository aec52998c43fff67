// Surfaces from files.
#pragma once

#include "render/stage/surface.h"

#include <filesystem>

namespace surflect::stage {

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

} // namespace surflect::stage
