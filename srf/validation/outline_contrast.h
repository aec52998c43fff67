// Thresholds for the contrast at the mesh's outline (ViewMeasures); misplaced meshes have 0.9 to 1.7.
#pragma once

namespace surflect::validation {

inline constexpr double kSteepOutline = 2, kFlatOutline = 1.5;

} // namespace surflect::validation
