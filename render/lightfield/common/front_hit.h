// Rays that meet the front of a surface, as pictures with back-face culling show it.
#pragma once

#include "surfel/geometry/mesh.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/math/space.h"

#include <optional>

namespace surflect::lightfield {

// First triangle whose front a ray meets; those that it meets from behind let it pass. `rays` is of the mesh.
std::optional<RayCaster<AcquisitionSpace>::Hit>
firstFrontHit(const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& rays,
              const Point3<AcquisitionSpace, double>& origin,
              const Direction3<AcquisitionSpace, double>& direction);

} // namespace surflect::lightfield
