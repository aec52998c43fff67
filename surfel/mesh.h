// The impostor as it is given: triangles in acquisition space; or bent, in object space.
#pragma once

#include "surfel/progress.h"
#include "surfel/space.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace surflect {

template <class Space> struct Mesh {
  std::vector<Point3<Space>> positions;
  std::vector<std::array<uint32_t, 3>> triangles;
};
using TriangleMesh = Mesh<AcquisitionSpace>;

// Twice the area vector of a triangle: its normal, not normalised.
Vec3<double> areaVector(const TriangleMesh& mesh, size_t triangle);

// Reads OBJ or PLY, by the extension (a file without one is PLY): faces (fan-triangulated) and triangle
// strips. `origin` is subtracted from the file's coordinates in double precision, before they are rounded to
// float. An index beyond the vertices or a position that is not finite is an Error. Throws Cancelled, too.
TriangleMesh readMeshAsStored(const std::filesystem::path& path, const Progress& progress = {},
                              const Vec3<double>& origin = Vec3<double>::Zero());

// Without the triangles that have no area; an Error when no other is left.
TriangleMesh withoutFlat(TriangleMesh mesh, const Progress& progress = {});
// As stored, without them.
TriangleMesh readMesh(const std::filesystem::path& path, const Progress& progress = {},
                      const Vec3<double>& origin = Vec3<double>::Zero());

} // namespace surflect
