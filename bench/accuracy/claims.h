// Measurements of claims in [Weyrich 2005]; tests compare them with theory. Each folder is created; captures
// and models are written into it.
//
// [Weyrich 2005] Weyrich, Pfister, Gross: Rendering Deformable Surface Reflectance Fields, TVCG 11(1).
#pragma once

#include "bench/accuracy/program.h"

#include <filesystem>

namespace surflect::bench {

Json impostorLimit();
Json textureParallax(const std::filesystem::path& folder);
Json fibreAzimuth(const std::filesystem::path& folder); // also writes fibres.png
Json fibreError();

} // namespace surflect::bench
