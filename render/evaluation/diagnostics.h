// What is most likely a mistake in a film that could be made all the same: lines for people.
#pragma once

#include "render/scene/shot.h"
#include "render/surfels/frame.h"

#include <optional>
#include <string>

namespace surflect::evaluation {

// Where more than a tenth of the surfels come to a mesh or skeleton warp beyond the reach of its rest mesh
// (MeshField::reaches), as when units or axes are others: which warp and how many, of the first such warp.
// Looks at no more than some thousands of surfels. Throws Error as freeze() does.
std::optional<std::string> beyondRestMesh(const scene::Script& script, const warp::ShotTime& time,
                                          const SurfelCloud& cloud);

// Where more than half of a cloud of so many surfels is dead or not finite, or no surfel is visible.
std::optional<std::string> emptyFrame(const surfels::FrameStats& stats, size_t surfels);

} // namespace surflect::evaluation
