// Binary space partitioning of triangles, for back-to-front order from any point.
//
// [Fuchs 1980] Fuchs, Kedem, Naylor: On Visible Surface Generation by a Priori Tree Structures, SIGGRAPH.
// [Vlasic 2003, §4.2] Vlasic et al.: Opacity Light Fields, I3D.
#pragma once

#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"
#include "surfel/math/space.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace surflect::olf {

// Part of a triangle of the mesh.
struct Piece {
  uint32_t triangle = 0;
  std::array<Vec3<double>, 3> corners;      // in the order of the triangle's
  std::array<Vec3<double>, 3> barycentrics; // of the corners, in the triangle
};

// The mesh's triangles as they are.
std::vector<Piece> wholePieces(const TriangleMesh& mesh);

class BspTree {
public:
  // The smallest of `trees` (>= 1) trees, each of triangles in a random order; the same one for the same
  // mesh. A node divides by the triangle whose plane cuts fewest of those below it, among the first few; the
  // paper takes the first one. Time grows with the square of the triangles where most are on one side of
  // each. Triangles without area are left out. Throws Cancelled.
  BspTree(const TriangleMesh& mesh, size_t trees, const Progress& progress = {});

  const std::vector<Piece>& pieces() const { return pieces_; }
  // Indices of all pieces: none hides a later one from the viewer.
  std::vector<uint32_t> backToFront(const Vec3<double>& viewer) const;

  size_t bytes() const;

private:
  struct Node {
    Vec3<double> normal;
    double offset = 0;
    uint32_t first = 0, end = 0;   // pieces in the plane
    int32_t front = -1, back = -1; // nodes
  };
  struct Tree {
    std::vector<Node> nodes;
    std::vector<Piece> pieces;
  };
  static Tree treeOf(std::vector<Piece> pieces, double tolerance, size_t limit, const Progress& progress);

  std::vector<Node> nodes_;
  std::vector<Piece> pieces_;
};

} // namespace surflect::olf
