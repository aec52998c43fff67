// Images of a spherical light field, path traced: an orthographic camera for each pencil of directions.
// [Domingo 2007, §3.1]
#pragma once

#include "render/lightfield/spherical/build.h"
#include "render/stage/stage_file.h"
#include "surfel/base/time.h"

#include <filesystem>

namespace surflect::traced {

// Writes the light field of a stage under all its training lights together, with the stage's samples, seed
// and transport. A texel's alpha is the share of it that the object covers; its height is that at its centre.
// The noise of an image is keyed by its direction: same bits for any number of threads and of levels. Throws
// Error, also for a stage without training frames or with an exposure, and Cancelled.
spherical::BuildReport build(const stage::Stage& stage, const spherical::BuildOptions& options,
                             const std::filesystem::path& folder, const Progress& progress = {});

} // namespace surflect::traced
