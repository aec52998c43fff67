// Warp by handles: points that move exactly to their targets, with smooth interpolation between them.
//
// [Wendland 1995] Piecewise polynomial, positive definite and compactly supported radial functions. [Botsch
// and Kobbelt 2005] Real-time shape editing using radial basis functions.
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
// exactly at each rest position r_i. The equations are factored once; each new set of displacements costs a
// substitution.
//
// Without a radius: phi(d) = d^3, the triharmonic function, twice continuously differentiable also at the
// handles [Botsch and Kobbelt 2005, §3]. The handles determine the affine part: four or more that are not in
// a plane reproduce affine motion. Three reproduce it in their plane and leave the perpendicular direction
// unchanged; one translates.
//
// With a radius: phi(d) = (1 - d/R)^4 (4 d/R + 1) for d < R [Wendland 1995], and no affine part: space
// further than R from every handle rests.
class Handles {
public:
  // Throws Error for no handles, more than mostHandles, or two that are nearer than 1/10000 of half the
  // diagonal of their box.
  Handles(std::vector<Vec3<double>> rest, std::optional<double> radius);

  size_t size() const;
  // Warp that moves each handle to its target; one target per handle.
  WarpPointer pullTo(std::span<const Vec3<double>> targets) const;

private:
  struct System;
  std::shared_ptr<const System> system_;
};

} // namespace surflect::warp
