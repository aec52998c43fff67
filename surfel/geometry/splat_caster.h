// Shadow rays against overlapping splats, by Embree in robust mode. A ray that is not finite, or from over
// 1e18 away, meets nothing.
#pragma once

#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <cmath>
#include <memory>
#include <vector>

namespace surflect {

// Longer half-axis of the ellipse that a unit circle becomes under tangents u and v: the largest singular
// value of the matrix (u, v).
template <class T> T longerAxis(const Vec3<T>& u, const Vec3<T>& v) {
  const T uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
  return std::sqrt((uu + vv) / 2 + std::hypot((uu - vv) / 2, uv));
}

// A splat of an opaque surface: its kernel is 1 at the centre, and 0 from the ellipse on that the vectors u
// and v span, which are its conjugate half-axes.
template <class Space> struct OpaqueSplat {
  Point3<Space> center;
  Direction3<Space> u, v; // scene units; not parallel
  float coverage = 1;     // of the surface by the kernel's peak
};

// Shadow rays against overlapping splats. A ray meets a splat with its coverage times the kernel
//   k = (1 - a^2 - b^2)^2   at the place   center + a u + b v
// and is blocked by the sum over all splats that it meets:
//   blocked = min(1, max(0, 4 sum - 1/2))
// So a shadow has the smooth outline of the surface, not that of its discs. Inside of a sheet the sum is
// about 1, at its border 1/2. Fine parts, which are all border, must not let light through: a half is blocked
// at 1/4 already, which moves the outline of a sheet outwards by less than the spacing of its splats.
template <class Space> class SplatCaster {
public:
  // Throws Error where the splats do not fit into memory, and Cancelled.
  explicit SplatCaster(const std::vector<OpaqueSplat<Space>>& splats, const Progress& progress = {});
  ~SplatCaster();
  SplatCaster(SplatCaster&&) noexcept;
  SplatCaster& operator=(SplatCaster&&) noexcept;

  // Part of the ray from `origin` along a unit direction that splats block between `offset` and `distance`,
  // 0..1. Continuous in the ray, save where a splat begins to lie within these distances.
  float blocked(const Point3<Space, double>& origin, const Direction3<Space, double>& direction,
                double offset, double distance) const;

private:
  struct Scene;
  std::unique_ptr<const Scene> scene_;
};

extern template class SplatCaster<AcquisitionSpace>;
extern template class SplatCaster<ObjectSpace>;

} // namespace surflect
