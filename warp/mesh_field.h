// Space that follows a mesh: what moves its vertices moves whatever is near them, smoothly.
//
// [Sumner et al. 2007] Embedded Deformation for Shape Manipulation, SIGGRAPH 2007.
// [Sumner and Popovic 2004] Deformation Transfer for Triangle Meshes, SIGGRAPH 2004.
// [Wendland 1995] Piecewise polynomial, positive definite and compactly supported radial functions.
#pragma once

#include "warp/warp.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace surflect::warp {

// A mesh at rest, bound to the space around it. Each vertex carries an affine map of its own: it takes the
// vertex to where it has gone and turns and stretches as the triangles around it have (Deformation
// Transfer's gradient, whose normal is scaled by the root of the triangle's area). Space is moved by the
// blend of these maps under kernels around the rest vertices:
//   Psi(x) = sum of w_i(x) (q_i + G_i (x - v_i)) / sum of w_i(x)
// like Embedded Deformation, but with kernels that are fixed in space and twice continuously differentiable
// (it takes the nearest nodes, whose set jumps). The mesh may be open, closed, coarse, in parts, and need
// only be near what it drives: within about the length of its edges. Further away the vertices fade into
// groups, each with the mean map of its members, and these into groups of groups, the larger the further;
// where even the largest do not reach, space follows the mean of all.
//
// A mesh at rest moves nothing; rigid motion and even scaling of the mesh move all space so. A vertex itself
// comes within second order of the length of the edges to where it has gone: the field is smoother than the
// mesh. Parts of the mesh that lie near each other pull on each other's surroundings.
class MeshField {
public:
  // Vertices at one place are one; triangles without area are passed over. Throws Error when no other is
  // left.
  MeshField(std::span<const Vec3<double>> rest, std::span<const std::array<uint32_t, 3>> triangles);

  size_t vertexCount() const; // of the mesh as given
  // Whether the point is within the kernel of a vertex, not just of groups of them: within about twice the
  // length of the edges around it. What a mesh is made to drive is.
  bool reaches(const Vec3<double>& x) const;
  // How many kernels are evaluated to move the point: a few tens near the mesh and as many for each size of
  // groups between, whatever the count of vertices.
  size_t kernelsAt(const Vec3<double>& x) const;
  // The warp that has moved each vertex of the rest mesh to the position given. Costs kernelsAt the point.
  WarpPointer follow(std::span<const Vec3<double>> positions) const;

private:
  struct Binding;
  std::shared_ptr<const Binding> binding_;
};

} // namespace surflect::warp
