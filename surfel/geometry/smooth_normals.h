// The normals of the smooth surface that a mesh of flat triangles stands for.
//
// A corner's normal is the mean over the triangles that meet there and turn away from its own by no more than
// the crease angle, so that edges stay, and so that no normal is farther than that from its triangle's.
// Weights are those of [Max 1999], by which the normals of a mesh with its vertices on a sphere are the
// sphere's.
//
// [Max 1999] Max: Weights for Computing Vertex Normals from Facet Normals, Journal of Graphics Tools 4(2).
// Symbols: d, e the edges of a triangle from a corner to the next and to the one before, b barycentrics.
#pragma once

#include "surfel/geometry/mesh.h"
#include "surfel/math/angle.h"

#include <vector>

namespace surflect {

// Between the normals of two triangles: a prism of ten sides is still round.
inline constexpr Angle kCreaseAngle = Angle::fromDegrees(40);

// A triangle's part in the normal of one of its corners: its normal times sin(angle) / (|d| |e|).
Vec3<double> normalShare(const Vec3<double>& d, const Vec3<double>& e); // [Max 1999, Eq. 2]

class SmoothNormals {
public:
  // The mesh must outlive this. Vertices at one place are one vertex. Triangles without area take no part;
  // where more than 256 triangles meet, the tip of a fan, each keeps its own normal.
  explicit SmoothNormals(const TriangleMesh& mesh, const Progress& progress = {});

  // Unit; interpolated between the corners of the triangle, which must have an area. Of points beside it, the
  // normal is that of the place on it with the same barycentrics, none below 0.
  Vec3<double> at(size_t triangle, const Vec3<double>& p) const;

private:
  const TriangleMesh& mesh_;
  std::vector<std::array<Vec3<float>, 3>> corners_; // unit; one of each triangle
};

} // namespace surflect
