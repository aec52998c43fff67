// A mesh with what its file says of the surface.
#pragma once

#include "surfel/mesh.h"

namespace surflect {

// Lists are empty where the file says nothing.
struct TexturedMesh {
  TriangleMesh mesh;
  std::vector<uint32_t> corner; // #vertices; equal for vertices that are one but for what follows
  std::vector<Vec2<double>> textureCoordinates; // #vertices or none; (0, 0) is the lower left
  std::vector<Vec3<double>> normals;            // #vertices or none; of any length
  std::vector<Vec3<double>> tangents;           // #vertices or none; of any length
};

} // namespace surflect
