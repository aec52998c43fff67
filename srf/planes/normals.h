// Normals of what planes show.
#pragma once

#include "srf/planes/basis.h"
#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <span>

namespace surflect::planes {

// Two planes: x to the right and y up of the unit normal that a robust Lambert fit finds (photometric.h), in
// the camera's frame; both 0 where it finds none. The fit sees the photographs of at most twelve lights,
// far apart, as the planes show them, so one pixel costs the same whatever the number of lights.
Planes normalsOf(const Planes& planes, const Basis& basis, std::span<const Vec3<double>> towardsLights,
                 const Progress& progress);

// Returns whether normals can be told: directions to three lights that are not in a plane with the object.
bool tellNormals(std::span<const Vec3<double>> towardsLights);

} // namespace surflect::planes
