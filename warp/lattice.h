// Free-form deformation: a lattice of control points over a box moves space.
//
// [Sederberg and Parry 1986] Free-Form Deformation of Solid Geometric Models, SIGGRAPH 86.
#pragma once

#include "warp/warp.h"

#include <array>
#include <vector>

namespace surflect::warp {

inline constexpr int mostLatticeDivisions = 16; // along one axis

// Box from `least` to `most`, divided into divisions[0] x [1] x [2] cells, whose corners are control points.
struct Lattice {
  Vec3<double> least, most;        // least < most
  std::array<int, 3> divisions{};  // each 1..mostLatticeDivisions
  std::vector<Vec3<double>> moves; // displacement of each control point; x runs fastest, then y

  size_t pointCount() const;
  size_t pointIndex(const std::array<int, 3>& point) const;
};

// Psi(x) = x + sum of B_i(s) B_j(t) B_k(u) move_ijk, with (s, t, u) in 0..1 the position in the box and B
// Bernstein polynomials [Sederberg and Parry 1986, Eq. 2]. Affine displacements of the points give that
// affine map. Outside of the box each B continues along its tangent, so the warp and its Jacobian are
// continuous everywhere and affine maps stay affine. Where the two outermost layers of points rest, all space
// beyond rests. Cost: about pointCount operations per point. Batches (Warp::carry) cost much less if the
// divisions along the three axes sum to at most 24 and powers of the box's sides fit into doubles. They cost
// least with 3 divisions along each axis.
WarpPointer latticeWarp(Lattice lattice);

} // namespace surflect::warp
