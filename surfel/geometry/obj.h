// Wavefront OBJ: the positions and faces of its one mesh, and texture coordinates and normals for who asks
// for them.
#pragma once

#include "surfel/base/progress.h"
#include "surfel/geometry/textured_mesh.h"

#include <filesystem>
#include <string_view>

namespace surflect {

// All faces of all groups, in the order written; triangles without area stay. Corners may count from the end
// (-1 is the last vertex so far); texture coordinates, normals, materials, lines and free-form curves are
// passed over. Throws Error at the line that is wrong.
TriangleMesh parseObj(std::string_view text, const MeshReading& reading = {}, const Progress& progress = {});
// Reads the mesh with texture coordinates and normals, see texturedMeshOf; `corner` is the file's vertex.
TexturedMesh parseTexturedObj(std::string_view text, const Progress& progress = {});
// Throw Error with the file and the line, and Cancelled.
TexturedMesh readTexturedObj(const std::filesystem::path& path, const Progress& progress = {});
TriangleMesh readObj(const std::filesystem::path& path, const MeshReading& reading = {},
                     const Progress& progress = {});

} // namespace surflect
