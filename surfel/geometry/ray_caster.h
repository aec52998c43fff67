// Rays against triangles, and shadow rays against opaque discs, by Embree in robust mode. A ray that is not
// finite, or from over 1e18 away, meets nothing.
#pragma once

#include "surfel/base/progress.h"
#include "surfel/geometry/mesh.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace surflect {

template <class Space> class RayCaster {
public:
  // The mesh is copied, recentred in double precision before it goes to float. Throws Error where it does not
  // fit into memory, and Cancelled.
  explicit RayCaster(const Mesh<Space>& mesh, const Progress& progress = {});
  ~RayCaster();

  struct Hit {
    uint32_t triangle;
    double distance; // along the unit direction
    double b, c;     // barycentrics of the second and third corner
  };
  std::optional<Hit> firstHit(const Point3<Space, double>& origin,
                              const Direction3<Space, double>& direction) const;

  // Is anything in the way from `origin`, leaving out the first `offset` of the unit direction?
  bool occluded(const Point3<Space, double>& origin, const Direction3<Space, double>& direction,
                double offset, double distance) const;

  // How many closed parts of the mesh the origin lies in, as told along one unit direction: the times that
  // the ray leaves the mesh through a back less those that it enters by a front. The same along every ray
  // where all parts are closed and their triangles face outwards.
  int winding(const Point3<Space, double>& origin, const Direction3<Space, double>& direction) const;

  // The length below which a ray cannot tell the surface that it starts on: from scene size and float
  // precision.
  double selfHitOffset() const;

private:
  struct Scene;
  std::unique_ptr<const Scene> scene_;
};

// Shadow rays against opaque, two-sided discs.
template <class Space> class DiscCaster {
public:
  // Discs around `centers` with unit `normals` and positive `radii`, one of each for every disc; they are
  // copied. Throws Error where they do not fit into memory, and Cancelled.
  DiscCaster(const std::vector<Point3<Space>>& centers, const std::vector<Normal3<Space>>& normals,
             const std::vector<float>& radii, const Progress& progress = {});
  ~DiscCaster();
  DiscCaster(DiscCaster&&) noexcept;
  DiscCaster& operator=(DiscCaster&&) noexcept;

  // Is a disc in the way from `origin` along a unit direction, between `offset` and `distance`?
  bool occluded(const Point3<Space, double>& origin, const Direction3<Space, double>& direction,
                double offset, double distance) const;

private:
  struct Scene;
  std::unique_ptr<const Scene> scene_;
};

extern template class RayCaster<AcquisitionSpace>;
extern template class RayCaster<ObjectSpace>;
extern template class DiscCaster<AcquisitionSpace>;
extern template class DiscCaster<ObjectSpace>;

} // namespace surflect
