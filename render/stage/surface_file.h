// Surfaces from files.
#pragma once

#include "render/stage/surface.h"

#include <filesystem>

namespace surflect {

// Throws Error as readMesh does. Smooth: normals are means over the triangles that share a vertex; else each
// triangle has its own. Tangents run round z.
Surface readSurface(const std::filesystem::path& path, bool smooth);

} // namespace surflect
