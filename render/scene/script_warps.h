// The [[warp]] tables of a script.
#pragma once

#include "render/scene/script_fields.h"
#include "warp/motion.h"

#include <optional>
#include <vector>

namespace surflect::scene {

// Warps in the order of their tables; empty without an entry. Throws Error at the field.
std::vector<warp::WarpMotion> asWarps(const std::optional<Entry>& entry);

} // namespace surflect::scene
