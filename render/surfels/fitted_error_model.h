// The error model of the AOV predicted_error, fitted to path-traced stages.
#pragma once

#include "render/surfels/predicted_error.h"

namespace surflect::surfels {

// Set by `scripts/confidence fit`; docs/stability.md says how well it predicts the errors of other objects.
inline constexpr ErrorModel kFittedErrorModel{.disagreement = 0.19, .structure = 0.32, .gap = 0.27};

} // namespace surflect::surfels
