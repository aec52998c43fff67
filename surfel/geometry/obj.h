// Wavefront OBJ: positions and faces as one mesh, optionally with texture coordinates and normals.
#pragma once

#include "surfel/base/time.h"
#include "surfel/geometry/textured_mesh.h"

#include <filesystem>
#include <string_view>

namespace surflect {

// All faces of all groups in file order, also triangles without area. Indices may count from the end (-1 is
// the last vertex so far). Texture coordinates, normals, materials, lines and free-form curves are ignored.
// Throws Error at the faulty line.
TriangleMesh parseObj(std::string_view text, const MeshReading& reading = {}, const Progress& progress = {});
// Mesh with texture coordinates and normals (texturedMeshOf); `corner` is the file's vertex.
TexturedMesh parseTexturedObj(std::string_view text, const Progress& progress = {});
// Reads a file as parseTexturedObj. Throws Error with file and line, and Cancelled.
TexturedMesh readTexturedObj(const std::filesystem::path& path, const Progress& progress = {});
TriangleMesh readObj(const std::filesystem::path& path, const MeshReading& reading = {},
                     const Progress& progress = {});

} // namespace surflect
