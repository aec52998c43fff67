// A mesh with texture coordinates, normals and tangents of its file.
#pragma once

#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/space.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace surflect {

// Triangulation of polygons that may be concave.
//
// [Meisters 1975] Meisters: Polygons Have Ears, American Mathematical Monthly 82(6). [Sutherland 1974]
// Sutherland, Sproull, Schumacker: A Characterization of Ten Hidden-Surface Algorithms, ACM Computing Surveys
// 6(1): Newell's normal, twice the area vector of a closed polygon.

// Sum of the cross products of successive corners: twice the area vector of a planar or non-planar polygon.
Vec3<double> newellNormal(std::span<const Vec3<double>> corners);

// Appends corners.size() - 2 triangles, as indices into `corners` (three or more), wound like the polygon.
// Uses the fan around the first corner if it covers the polygon, as for every convex one; otherwise clips
// ears in the projection along the axis nearest to Newell's normal. Corners may repeat, as at a seam that
// joins a hole to the outline, and may be collinear: these corners get triangles without area. A
// self-intersecting polygon gets the same number of triangles, some of which overlap. Cost: O(n) for fans;
// O(n) per corner of a concave polygon at worst. Throws Cancelled.
void appendTriangles(std::span<const Vec3<double>> corners, std::vector<std::array<uint32_t, 3>>& triangles,
                     const Progress& progress = {});

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
