// Diagnostics of a film that renders but is most likely wrong, as messages for the user.
#pragma once

#include "render/scene/shot.h"

#include <optional>
#include <span>
#include <string>

namespace surflect::evaluation {

// One line if more than a tenth of the object's points come to a mesh or skeleton warp beyond the reach of
// its rest mesh (MeshField::reaches), as when units or axes differ: names the first such warp and the share.
// Tests some thousands of the points at most. Throws Error as evaluateAt does.
std::optional<std::string> beyondRestMesh(const scene::Script& script, const warp::ShotTime& time,
                                          std::span<const Point3<AcquisitionSpace>> object);

} // namespace surflect::evaluation
