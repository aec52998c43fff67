// Triangle meshes in files of a light field, exactly: two counts of 64 bits, then positions and triangles,
// little-endian.
#pragma once

#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

#include <filesystem>

namespace surflect::lightfield {

// Throws Error if the file cannot be written.
void writeMeshFile(const std::filesystem::path& path, const TriangleMesh& mesh);

// Throws Error naming the file unless it is complete, positions are finite and corners of triangles are
// positions; and Cancelled.
TriangleMesh readMeshFile(const std::filesystem::path& path, const Progress& progress = {});

} // namespace surflect::lightfield
