// A mesh with texture coordinates, normals and tangents of its file.
#pragma once

#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

namespace surflect {

// Lists are empty if the file has no such data.
struct TexturedMesh {
  TriangleMesh mesh;
  std::vector<uint32_t> corner; // #vertices; equal for vertices that differ only in the data below
  std::vector<Vec2<double>> textureCoordinates; // #vertices or empty; (0, 0) is the lower left
  std::vector<Vec3<double>> normals;            // #vertices or empty; any length, 0 where the file has none
  std::vector<Vec3<double>> tangents;           // #vertices or empty; any length, 0 where the file has none
};

// Faces as in files: each corner has a position, and optionally a texture coordinate and a normal.
struct FaceList {
  static constexpr uint32_t kNone = ~0u;
  struct Corner {
    uint32_t vertex, texture = kNone, normal = kNone;

    auto operator<=>(const Corner&) const = default;
  };

  std::vector<Point3<AcquisitionSpace>> positions;
  std::vector<Vec2<double>> textureCoordinates;
  std::vector<Vec3<double>> normals;
  std::vector<Corner> corners;
  std::vector<size_t> start = {
      0}; // #faces + 1; face f has the corners from start[f] to start[f+1], 3 or more

  size_t faceCount() const { return start.size() - 1; }
  void endFace() { start.push_back(corners.size()); } // ends the face of the corners added since the last one
};

// Mesh of all positions, in their order. Throws Cancelled.
TriangleMesh meshOf(FaceList list, Faces faces, const Progress& progress);

// Mesh with one vertex per combination of position, texture coordinate and normal, in the order of the
// corners. If some faces have texture coordinates, a face with a corner without one lies at (0, 0). A face
// with a corner without a normal has none. Throws Cancelled.
TexturedMesh texturedMeshOf(const FaceList& list, Faces faces, const Progress& progress);

} // namespace surflect
