// Free-form deformation: space is moved by the control points of a lattice over a box.
//
// [Sederberg and Parry 1986] Free-Form Deformation of Solid Geometric Models, SIGGRAPH 86.
#pragma once

#include "warp/warp.h"

#include <array>
#include <vector>

namespace surflect::warp {

inline constexpr int mostLatticeDivisions = 16; // along one axis

// The box from `least` to `most`, cut into divisions[0] x [1] x [2] cells, whose corners are control points.
struct Lattice {
  Vec3<double> least, most;        // least < most
  std::array<int, 3> divisions{};  // each 1..mostLatticeDivisions
  std::vector<Vec3<double>> moves; // how far each control point is from its rest; x runs fastest, then y

  size_t pointCount() const;
  size_t pointIndex(const std::array<int, 3>& point) const;
};

// Psi(x) = x + sum of B_i(s) B_j(t) B_k(u) move_ijk, with (s, t, u) the place in the box, 0..1, and B
// Bernstein polynomials [Sederberg and Parry 1986, Eq. 2]: moves that are an affine function of their point's
// rest give that affine map. Beyond the box each B goes on along its tangent, so that the warp and its
// Jacobian are continuous everywhere and affine maps stay affine; where the two outermost layers of points
// rest, so does all space beyond. Costs about pointCount operations a point; in batches (Warp::carry) much
// less, if there are no more than 24 divisions along the three axes together and doubles hold powers of the
// box's sides; least with 3 along each.
WarpPointer latticeWarp(Lattice lattice);

} // namespace surflect::warp
