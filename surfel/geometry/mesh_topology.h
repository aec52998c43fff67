// Connectivity of a mesh. Vertices at one position count as one vertex throughout.
#pragma once

#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"

#include <cstdint>
#include <vector>

namespace surflect {

// #vertices: index of the first vertex at the same position.
std::vector<uint32_t> firstAtPlace(const TriangleMesh& mesh, const Progress& progress = {});

// Triangles with the same three corners.
struct Repeats {
  std::vector<uint32_t> first; // #triangles; index of the first triangle with these corners, possibly itself
  std::vector<uint8_t> isBack; // #triangles; first triangle with these corners that is wound the other way

  bool isCopy(uint32_t triangle) const { return first[triangle] != triangle && !isBack[triangle]; }
};
Repeats repeatsIn(const TriangleMesh& mesh, const Progress& progress = {});

// Parts: triangles connected by edges that exactly two of them share.
struct MeshParts {
  struct Part {
    std::vector<uint32_t> triangles; // indices in rising order
    double area = 0;
    Eigen::AlignedBox3d box;
    bool isOrientable = true; // consistent winding exists (not a Moebius strip)
  };
  std::vector<Part> parts;        // in the order of their first triangles
  std::vector<uint8_t> isAgainst; // #triangles; wound against most of their part, by area
};

// Parts of a mesh whose triangles have an area. Throws Cancelled.
MeshParts partsOf(const TriangleMesh& mesh, const Progress& progress = {});

} // namespace surflect
