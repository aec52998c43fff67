// Rays that meet the front of a surface, as pictures with back-face culling show it.
#pragma once

#include "surfel/geometry/mesh.h"
#include "surfel/geometry/ray_caster.h"
#include "surfel/math/space.h"

#include <optional>

namespace surflect::lightfield {

// First triangle whose front a ray meets; triangles that the ray meets from behind are ignored. `rays` casts
// rays at the mesh.
std::optional<RayCaster<AcquisitionSpace>::Hit>
firstFrontHit(const TriangleMesh& mesh, const RayCaster<AcquisitionSpace>& rays,
              const Point3<AcquisitionSpace, double>& origin,
              const Direction3<AcquisitionSpace, double>& direction);

} // namespace surflect::lightfield
