// One view under many lights: sets of reflectance transformation imaging (RTI, PTM) and photometric stereo.
//
// Light files: .lp (the number of photographs, then "file x y z" a line), the same without the number, or
// with names, or ordinals, of photographs; "x y z" a line; or the three rows x, y, z, one column a light.
// x to the right, y up, z from the object to the camera. [HP Labs, "Making PTMs with a .lp File"]
#pragma once

#include "srf/import/source.h"
#include "surfel/angle.h"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace surflect {

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
// Lights without names are those of the folder's pictures in their natural order (2 before 10); a picture
// whose name ends in "mask" is the mask of all. Strengths are those of light_intensities.txt beside the light
// file, r g b a line; otherwise unknown: irradiance 1, and for positions one intensity that gives irradiance
// 1 at the origin on average. Throws Error with the line.
Source readLitView(const std::filesystem::path& folder, const std::filesystem::path& lights,
                   const LitViewOptions& options, bool allowOutside);

// One light of a light file. The name is empty where the file has none.
struct LightEntry {
  std::string name;
  Vec3<double> vector;
  size_t line = 0;
};
std::vector<LightEntry> parseLights(std::string_view content);

// 2 before 10: digits compare as numbers.
bool naturallyBefore(std::string_view a, std::string_view b);

} // namespace surflect
