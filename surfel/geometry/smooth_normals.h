// Normals of the smooth surface that a triangle mesh approximates.
//
// The normal at a triangle's corner is the mean over the triangles that meet there, except those that differ
// from this triangle by more than the crease angle. So creases are kept, and no normal differs from its
// triangle's by more than that angle. With the weights of [Max 1999], normals of a mesh whose vertices lie on
// a sphere are the sphere's.
//
// [Max 1999] Max: Weights for Computing Vertex Normals from Facet Normals, Journal of Graphics Tools 4(2).
// Symbols: d, e the edges of a triangle from a corner to the next and to the previous one, b barycentrics.
#pragma once

#include "surfel/geometry/mesh.h"
#include "surfel/math/space.h"

#include <vector>

namespace surflect {

// Largest angle between the normals of two triangles across a smooth edge: a prism of ten sides is still
// round.
inline constexpr Angle kCreaseAngle = Angle::fromDegrees(40);

// Contribution of a triangle to the normal at one of its corners: its normal times sin(angle) / (|d| |e|).
Vec3<double> normalShare(const Vec3<double>& d, const Vec3<double>& e); // [Max 1999, Eq. 2]

class SmoothNormals {
public:
  // The mesh must outlive this object. Vertices at one position are one vertex. Triangles without area are
  // ignored. Where more than 256 triangles meet, as at the tip of a fan, each keeps its own normal.
  explicit SmoothNormals(const TriangleMesh& mesh, const Progress& progress = {});

  // Unit normal, interpolated between the corners of the triangle, which must have an area. Barycentrics of
  // points beside the triangle are clamped to 0.
  Vec3<double> at(size_t triangle, const Vec3<double>& p) const;

private:
  const TriangleMesh& mesh_;
  std::vector<std::array<Vec3<float>, 3>> corners_; // unit; three per triangle
};

} // namespace surflect
