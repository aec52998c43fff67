// Diagnostics of a film that renders but is most likely wrong, as messages for the user.
#pragma once

#include "render/scene/scene.h"

#include <optional>
#include <span>
#include <string>

namespace surflect::evaluation {

// Reports the first mesh or skeleton warp whose rest mesh does not reach more than a tenth of the object's
// points (MeshField::reaches), as happens when units or axes differ, and their share. Examines at most a few
// thousand points. Throws Error as warp::evaluateAt.
std::optional<std::string> beyondRestMesh(const scene::Script& script, const warp::ShotTime& time,
                                          std::span<const Point3<AcquisitionSpace>> object);

} // namespace surflect::evaluation
