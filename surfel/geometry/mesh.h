// The impostor as it is given: triangles in acquisition space; or bent, in object space.
#pragma once

#include "surfel/base/progress.h"
#include "surfel/math/space.h"

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

// How a face with more than three corners becomes triangles.
enum class Faces {
  cut,   // what they cover, see ear_clipping.h
  asFans // around the first corner, wherever the corners lie: alike for all shapes of one topology
};

struct MeshReading {
  Faces faces = Faces::cut;
  Vec3<double> origin = {0, 0, 0}; // subtracted from the file's coordinates before they are rounded to float
};

// Reads OBJ or PLY, by the extension (a file without one is PLY): faces and triangle strips. An index beyond
// the vertices or a position that is not finite is an Error. Throws Cancelled, too.
TriangleMesh readMeshAsStored(const std::filesystem::path& path, const MeshReading& reading = {},
                              const Progress& progress = {});

// Without the triangles that have no area; an Error when no other is left.
TriangleMesh withoutFlat(TriangleMesh mesh, const Progress& progress = {});
// Without the positions that no triangle uses.
TriangleMesh withoutUnused(TriangleMesh mesh);
// As stored, without either.
TriangleMesh readMesh(const std::filesystem::path& path, const MeshReading& reading = {},
                      const Progress& progress = {});

} // namespace surflect
