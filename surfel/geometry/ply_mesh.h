// Meshes in PLY files: their faces and triangle strips, and what they say of the surface.
#pragma once

#include "surfel/geometry/textured_mesh.h"

#include <filesystem>

namespace surflect {

// All vertices and triangles. Throws Error with the file and the element, and Cancelled.
TriangleMesh readPlyMesh(const std::filesystem::path& path, const MeshReading& reading = {},
                         const Progress& progress = {});

// Reads the mesh with texture coordinates and normals, see texturedMeshOf; `corner` is the file's vertex.
// Vertices have coordinates as s and t, u and v, or texture_u and texture_v, normals as nx, ny and nz; the
// list `texcoord` of a face, two numbers a corner, comes first where it has them.
TexturedMesh readTexturedPly(const std::filesystem::path& path, const Progress& progress = {});

} // namespace surflect
