// Rays against triangles, by Embree in robust mode. A ray that is not finite, or from over 1e18 away, meets
// nothing.
#pragma once

#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace surflect {

template <class Space> class RayCaster {
public:
  // The mesh is copied, and recentred in double precision before it is rounded to float. Throws Error where
  // it does not fit into memory, and Cancelled.
  explicit RayCaster(const Mesh<Space>& mesh, const Progress& progress = {});
  ~RayCaster();

  struct Hit {
    uint32_t triangle;
    double distance; // along the unit direction
    double b, c;     // barycentrics of the second and third corner
  };
  std::optional<Hit> firstHit(const Point3<Space, double>& origin,
                              const Direction3<Space, double>& direction) const;

  // Returns whether the mesh blocks the ray from `origin` along a unit direction, between `offset` and
  // `distance`.
  bool occluded(const Point3<Space, double>& origin, const Direction3<Space, double>& direction,
                double offset, double distance) const;

  // Number of closed parts of the mesh that contain the origin, counted along a ray in the unit direction:
  // hits of backs minus hits of fronts. It is the same in all directions if all parts are closed and their
  // triangles face outwards.
  int winding(const Point3<Space, double>& origin, const Direction3<Space, double>& direction) const;

  // Distance within which a ray may hit the surface that it starts on, by scene size and float precision.
  double selfHitOffset() const;

private:
  struct Scene;
  std::unique_ptr<const Scene> scene_;
};

extern template class RayCaster<AcquisitionSpace>;
extern template class RayCaster<ObjectSpace>;

} // namespace surflect
