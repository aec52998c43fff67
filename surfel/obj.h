// Wavefront OBJ: the positions and faces of its one mesh.
#pragma once

#include "surfel/mesh.h"
#include "surfel/progress.h"

#include <filesystem>
#include <string_view>

namespace surflect {

// All faces of all groups, fan-triangulated, in the order written; triangles without area stay. Corners may
// count from the end (-1 is the last vertex so far); texture coordinates, normals, materials, lines and
// free-form curves are passed over. Throws Error at the line that is wrong.
TriangleMesh parseObj(std::string_view text, const Progress& progress = {});
// Throws Error with the file and the line, and Cancelled.
TriangleMesh readObj(const std::filesystem::path& path, const Progress& progress = {});

} // namespace surflect
