// Radiance along rays, from photographs of the point where a ray first meets the object.
//
// [Buehler 2001] (srf/weights/ulr.h)
// Symbols: P the point where a ray first meets the object; penalty_c the penalty of view c: 1 - cos(angle at
// P between the ray and the direction to c), divided by the fades of c.
#pragma once

#include "render/lightfield/common/photographs.h"
#include "render/lightfield/common/sight.h"
#include "render/lightfield/common/views.h"
#include "surfel/base/time.h"
#include "surfel/geometry/mesh.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/math/space.h"

#include <Eigen/Core>

#include <cstddef>
#include <optional>

namespace surflect::lightfield {

// Rays that meet the front of a surface, as pictures with back-face culling show it.

// First triangle whose front a ray meets; triangles that the ray meets from behind are ignored. `rays` casts
// rays at the mesh.
std::optional<RayCaster<AcquisitionSpace>::Hit>
firstFrontHit(const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& rays,
              const Point3<AcquisitionSpace, double>& origin,
              const Direction3<AcquisitionSpace, double>& direction);

struct RayBlend {
  size_t views = 4;     // blended for each ray, 1..weights::kMaxBlended
  bool nearest = false; // takes the nearest view alone
};

struct RaySample {
  enum class Kind {
    missed, // the ray does not meet the object
    unseen, // no view sees P
    seen
  };
  Kind kind = Kind::missed;
  Eigen::Vector3f color = Eigen::Vector3f::Zero();
  double distance = 0; // along the unit direction to P, unless missed
};

class RayRadiance {
public:
  // Reads the training views of a capture, which must outlive this object. Throws Error and Cancelled.
  RayRadiance(const Views& views, const RayBlend& blend, const Progress& progress = {});

  // Radiance at P: that of the nearest photograph that sees P (sight.h), or a blend by the weights of
  // unstructured lumigraph rendering. The direction is unit.
  RaySample along(const Point3<AcquisitionSpace, double>& origin,
                  const Direction3<AcquisitionSpace, double>& direction) const;

private:
  const Views& input_;
  RayBlend blend_;
  Photographs photographs_;
  Sight sight_;
};

} // namespace surflect::lightfield
