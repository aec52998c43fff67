// Diagnostics of a film that renders but is most likely wrong, as messages for the user.
#pragma once

#include "render/scene/shot.h"
#include "render/surfels/frame.h"

#include <optional>
#include <string>

namespace surflect::evaluation {

// Reports the first mesh or skeleton warp whose rest mesh does not reach more than a tenth of the surfels
// (MeshField::reaches), as happens when units or axes differ. Examines at most a few thousand surfels.
// Throws Error as warp::evaluateAt.
std::optional<std::string> beyondRestMesh(const scene::Script& script, const warp::ShotTime& time,
                                          const SurfelCloud& cloud);

// Reports if more than half of the cloud's `surfels` surfels are dead or not finite, or none is visible.
std::optional<std::string> emptyFrame(const surfels::FrameStats& stats, size_t surfels);

} // namespace surflect::evaluation
