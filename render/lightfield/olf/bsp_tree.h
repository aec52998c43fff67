// Binary space partitioning of triangles, for the back-to-front order of those that face any point.
//
// [Fuchs 1980] Fuchs, Kedem, Naylor: On Visible Surface Generation by a Priori Tree Structures, SIGGRAPH.
// [Schumacker 1969] Schumacker et al.: Study for Applying Computer-Generated Images to Visual Simulation.
// [Vlasic 2003, §4.2] Vlasic et al.: Opacity Light Fields, I3D.
//
// Triangles that face away from the viewer are not drawn. Of two triangles that face the viewer, a hides b
// only if a part of a lies in front of b's plane, and a part of b behind a's: a ray from the viewer comes
// through a's plane from the front, then to b's front. Triangles whose relations of this kind have no cycle
// have one order for all viewers [Schumacker 1969]. Only those within a cycle need a dividing plane, which
// may cut some.
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
  // Triangles without area are left out. Time grows with the square of the triangles. Throws Cancelled.
  explicit BspTree(const TriangleMesh& mesh, const Progress& progress = {});

  const std::vector<Piece>& pieces() const { return pieces_; }
  // Indices of all pieces: none that faces the viewer hides a later one that does.
  std::vector<uint32_t> backToFront(const Vec3<double>& viewer) const;

  size_t bytes() const;

private:
  // Draws the subtree that is farther from the viewer, its own pieces, then the nearer subtree.
  struct Node {
    Vec3<double> normal = Vec3<double>::Zero(); // of the dividing plane; 0: `front` is nearer to all viewers
    double offset = -1;
    uint32_t first = 0, end = 0;   // pieces in the plane, or that `back` never hides and `front` may
    int32_t front = -1, back = -1; // nodes
  };

  std::vector<Node> nodes_;
  std::vector<Piece> pieces_;
};

} // namespace surflect::olf
