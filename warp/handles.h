// Space pulled by handles: points that go exactly where they are told, and the rest follows smoothly.
//
// [Wendland 1995] Piecewise polynomial, positive definite and compactly supported radial functions.
// [Botsch and Kobbelt 2005] Real-time shape editing using radial basis functions.
#pragma once

#include "warp/warp.h"

#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace surflect::warp {

inline constexpr size_t mostHandles = 1024;

// Interpolates the handles' displacements by radial basis functions,
//   Psi(x) = x + sum of w_i phi(|x - r_i|) + affine(x),
// exactly at each rest position r_i. The equations are factored once; each time costs a substitution.
//
// Without a radius: phi(d) = d^3, the triharmonic function, twice continuously differentiable also at
// the handles [Botsch and Kobbelt 2005, §3], and the affine part is what the handles span. Four or more that
// are not in one plane move space affinely when they are moved so; three move it by the affine map of
// their plane and leave what is across it, one translates it.
// With a radius: phi(d) = (1 - d/R)^4 (4 d/R + 1) within it [Wendland 1995], and no affine part: space
// further than R from every handle rests.
class Handles {
public:
  // Throws Error where there are none, more than mostHandles, or two nearer each other than 1/10000 of
  // half the diagonal of their box.
  Handles(std::vector<Vec3<double>> rest, std::optional<double> radius);

  size_t size() const;
  // The warp that takes each handle to its target. One target a handle.
  WarpPointer pullTo(std::span<const Vec3<double>> targets) const;

private:
  struct System;
  std::shared_ptr<const System> system_;
};

} // namespace surflect::warp
