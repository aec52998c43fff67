// A mesh with what its file says of the surface.
#pragma once

#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

namespace surflect {

// Lists are empty where the file says nothing.
struct TexturedMesh {
  TriangleMesh mesh;
  std::vector<uint32_t> corner; // #vertices; equal for vertices that are one but for what follows
  std::vector<Vec2<double>> textureCoordinates; // #vertices or none; (0, 0) is the lower left
  std::vector<Vec3<double>> normals;            // #vertices or none; of any length, 0 where the file has none
  std::vector<Vec3<double>> tangents;           // #vertices or none; of any length, 0 where the file has none
};

// Faces as files list them: each corner names a position, and perhaps a texture coordinate and a normal.
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
  void endFace() { start.push_back(corners.size()); } // of the corners since the last one
};

// All positions, in their order. Throws Cancelled.
TriangleMesh meshOf(FaceList list, Faces faces, const Progress& progress);

// Each position once for every pair of a texture coordinate and a normal that it has, in the order of the
// corners. A face with a corner that has no texture coordinate lies at (0, 0) of the texture, if other faces
// have coordinates; one with a corner that has no normal has none. Throws Cancelled.
TexturedMesh texturedMeshOf(const FaceList& list, Faces faces, const Progress& progress);

} // namespace surflect
