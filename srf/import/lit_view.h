// One view under many lights: sets of reflectance transformation imaging (RTI, PTM) and photometric stereo.
#pragma once

#include "srf/import/source.h"
#include "surfel/math/angle.h"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace surflect::importers {

struct LitViewOptions {
  bool positions = false;           // the light file gives where lights stand, not directions towards them
  std::optional<Angle> fieldOfView; // vertical, of a pinhole; none: orthographic
  double height = 1;                // of what the picture shows of the plane z = 0, scene units
};

// The light file in a folder of photographs; none: empty. Throws Error if there are several .lp files.
std::optional<std::filesystem::path> findLights(const std::filesystem::path& folder);

// The camera looks along -z at the origin, in the middle of the picture, from 2 heights away if it is
// orthographic, else from where the field of view meets the height.
//
// Lights without names are those of the pictures that filenames.txt lists, one a line, as in DiLiGenT [Shi et
// al. 2016]; without such a list, of all the folder's pictures in their natural order (2 before 10). Names
// that differ from the pictures' in letter case or extension are those of pictures where just one fits. A
// picture whose name ends in "mask" is the mask of all. Strengths are those of light_intensities.txt beside
// the light file, r g b a line; otherwise unknown: irradiance 1, and for positions one intensity that gives
// irradiance 1 at the origin on average. Throws Error with the line.
Source readLitView(const std::filesystem::path& folder, const std::filesystem::path& lights,
                   const LitViewOptions& options, bool allowOutside);

} // namespace surflect::importers
