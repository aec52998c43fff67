// Meshes in PLY files: faces and triangle strips, and their texture coordinates and normals.
#pragma once

#include "surfel/geometry/textured_mesh.h"

#include <filesystem>

namespace surflect {

// Reads all vertices and triangles. Throws Error with file and element, and Cancelled.
TriangleMesh readPlyMesh(const std::filesystem::path& path, const MeshReading& reading = {},
                         const Progress& progress = {});

// Reads the mesh with texture coordinates and normals (texturedMeshOf); `corner` is the file's vertex.
// Texture coordinates of vertices are s and t, u and v, or texture_u and texture_v; normals are nx, ny and
// nz. A face's list `texcoord`, two numbers per corner, overrides them.
TexturedMesh readTexturedPly(const std::filesystem::path& path, const Progress& progress = {});

} // namespace surflect
