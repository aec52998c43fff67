// Surfaces from files.
#pragma once

#include "render/stage/surface.h"

#include <filesystem>

namespace surflect::stage {

struct SurfaceFile {
  Surface surface;
  uint64_t hash; // of all that was read
};

// Reads .glb and .gltf as readGltfMesh does, .obj and .ply with their texture coordinates and normals, in the
// axes of the file and without triangles that have no area. Where the normals of a triangle's corners all
// point away from its front, they are right and the triangle is turned. Smooth: normals and tangents are the
// file's, or else means over the triangles that share a vertex; not smooth: each triangle has its own.
// Tangents that no file gives run along the texture's first coordinate, or, where there is none, round z.
// Throws Error.
SurfaceFile readSurface(const std::filesystem::path& path, bool smooth);

} // namespace surflect::stage
