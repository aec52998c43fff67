// Claims of [Weyrich 2005], measured; tests hold them to theory. Folders are new ones, for captures and
// models.
//
// [Weyrich 2005] Weyrich, Pfister, Gross: Rendering Deformable Surface Reflectance Fields, TVCG 11(1).
#pragma once

#include "bench/accuracy/program.h"

#include <filesystem>

namespace surflect::bench {

Json impostorLimit();
Json textureParallax(const std::filesystem::path& folder);
Json fibreAzimuth(const std::filesystem::path& folder); // writes fibres.png into it
Json fibreError();

} // namespace surflect::bench
