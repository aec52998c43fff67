// Triangle meshes: an impostor in acquisition space, or deformed in object space.
#pragma once

#include "surfel/base/time.h"
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

// Area-weighted normal of a triangle, twice its area vector.
Vec3<double> areaVector(const TriangleMesh& mesh, size_t triangle);
double surfaceArea(const TriangleMesh& mesh);

// Triangulation of faces with more than three corners.
enum class Faces {
  cut,   // covers the face exactly (textured_mesh.h)
  asFans // around the first corner: the same triangles for all shapes of one topology
};

struct MeshReading {
  Faces faces = Faces::cut;
  Vec3<double> origin = {0, 0, 0}; // subtracted from the file's coordinates before rounding to float
};

// Reads OBJ or PLY by the extension (PLY if there is none): faces and triangle strips. Throws Error, also for
// an index beyond the vertices and a position that is not finite; throws Cancelled.
TriangleMesh readMeshAsStored(const std::filesystem::path& path, const MeshReading& reading = {},
                              const Progress& progress = {});

// Removes triangles without area; throws Error if none is left.
TriangleMesh withoutFlat(TriangleMesh mesh, const Progress& progress = {});
// Removes positions that no triangle uses.
TriangleMesh withoutUnused(TriangleMesh mesh);
// Reads a mesh as readMeshAsStored(), then removes triangles without area and unused positions.
TriangleMesh readMesh(const std::filesystem::path& path, const MeshReading& reading = {},
                      const Progress& progress = {});

} // namespace surflect
