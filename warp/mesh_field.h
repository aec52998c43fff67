// Warp by a mesh: space near the mesh follows its vertices smoothly.
//
// [Sumner et al. 2007] Embedded Deformation for Shape Manipulation, SIGGRAPH 2007. [Sumner and Popovic 2004]
// Deformation Transfer for Triangle Meshes, SIGGRAPH 2004. [Wendland 1995] Piecewise polynomial, positive
// definite and compactly supported radial functions.
#pragma once

#include "warp/warp.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace surflect::warp {

// A mesh at rest, bound to the space around it. Each vertex carries an affine map that moves it to its
// deformed position, and rotates and stretches like the triangles around it (Deformation Transfer's gradient,
// whose normal is scaled by the root of the triangle's area). Space is moved by the blend of these maps under
// kernels around the rest vertices:
//   Psi(x) = sum of w_i(x) (q_i + G_i (x - v_i)) / sum of w_i(x)
// This is Embedded Deformation with kernels that are fixed in space and twice continuously differentiable;
// the original uses the nearest nodes, a set that changes abruptly. The mesh may be open, closed, coarse or
// in parts. It must be near the driven surface, within about the length of its edges. Further away the
// vertices fade into groups, each with the mean map of its members, and these into larger groups. Beyond the
// largest groups, space follows the mean of all maps.
//
// A mesh at rest moves nothing; a rigid motion or even scaling of the mesh moves all space in that way. A
// vertex reaches its deformed position only up to second order of the edge length: the field is smoother than
// the mesh. Parts of the mesh that lie near each other affect each other's surroundings.
class MeshField {
public:
  // Vertices at one position are merged; triangles without area are ignored. Throws Error if none is left.
  MeshField(std::span<const Vec3<double>> rest, std::span<const std::array<uint32_t, 3>> triangles);

  // Returns whether the point is within the kernel of a vertex, not only of groups: within about twice the
  // length of the edges around it. The driven surface should be within reach.
  bool reaches(const Vec3<double>& x) const;
  // Number of kernels evaluated for the point: a few tens near the mesh, and as many for each size of groups,
  // for any number of vertices.
  size_t kernelsAt(const Vec3<double>& x) const;
  // Warp that moves each vertex of the rest mesh to the given position. Cost: kernelsAt the point.
  WarpPointer follow(std::span<const Vec3<double>> positions) const;

private:
  struct Binding;
  std::shared_ptr<const Binding> binding_;
};

} // namespace surflect::warp
