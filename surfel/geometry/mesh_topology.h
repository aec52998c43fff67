// How the triangles of a mesh hang together. Vertices at one place count as one vertex throughout.
#pragma once

#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

#include <cstdint>
#include <vector>

namespace surflect {

// #vertices: the first vertex at the same place.
std::vector<uint32_t> firstAtPlace(const TriangleMesh& mesh, const Progress& progress = {});

// Triangles with the same three corners.
struct Repeats {
  std::vector<uint32_t> first; // #triangles; the first one with its corners, perhaps itself
  std::vector<uint8_t> isBack; // #triangles; the first one that is wound the other way than that

  bool isCopy(uint32_t triangle) const { return first[triangle] != triangle && !isBack[triangle]; }
};
Repeats repeatsIn(const TriangleMesh& mesh, const Progress& progress = {});

// Triangles joined over edges that exactly two of them share.
struct MeshParts {
  struct Part {
    std::vector<uint32_t> triangles; // in rising order
    double area = 0;
    Eigen::AlignedBox3d box;
    bool isOrientable = true; // its triangles can be wound alike: no Moebius strip
  };
  std::vector<Part> parts;        // by their first triangles
  std::vector<uint8_t> isAgainst; // #triangles; wound against most of their part, by area
};

// Works on triangles with an area. Throws Cancelled.
MeshParts partsOf(const TriangleMesh& mesh, const Progress& progress = {});

} // namespace surflect
