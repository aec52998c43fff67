// One view under many lights: sets of reflectance transformation imaging (RTI, PTM) and photometric stereo.
#pragma once

#include "srf/import/foreign_capture.h"
#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::importers {

// Light files of RTI and photometric stereo.
//
// Formats: .lp (the number of photographs, then "file x y z" per line), also without the number, or with bare
// names or ordinals; "x y z" per line; three rows x, y, z with a column per light. x right, y up, z from the
// object to the camera. [HP Labs, "Making PTMs with a .lp File"]

// Separators between numbers besides blanks.
inline constexpr std::string_view kLightSeparators = ",;";

// One light of a light file; the name is empty if the file has none.
struct LightEntry {
  std::string name;
  Vec3<double> vector;
  size_t line = 0; // 0: not of a file
};
// Parses lights whose numbers have decimal points. Throws Error with the line.
std::vector<LightEntry> parseLights(std::string_view content);

// Returns the content with decimal commas replaced by points, of the same length. Decimal commas are a
// convention of the whole file: the last three words of each line, separated by blanks or ";", are numbers
// without a point. Throws Error if some lines have commas and others points, or if commas may be separators.
std::string withDecimalPoints(std::string_view content);

struct LitViewOptions {
  bool positions = false;           // the light file states positions of lights instead of directions
  std::optional<Angle> fieldOfView; // vertical, of a pinhole; none: orthographic
  std::filesystem::path
      chromeBall;    // pictures of a mirror ball under the same lights, instead of a light file
  double height = 1; // height of the picture's section of the plane z = 0, scene units
};

// Light file of a folder of photographs, or of an RTIBuilder project, whose assembly-files/ has it; empty if
// there is none. Throws Error for several .lp files.
std::optional<std::filesystem::path> findLights(const std::filesystem::path& folder);
// Folder of the photographs of a light file: its own, or jpeg-exports/ of an RTIBuilder project.
std::filesystem::path folderOfPhotographs(const std::filesystem::path& lights);

// Reads photographs of one view. The camera looks along -z at the origin, in the middle of the picture, from
// 2 heights away if orthographic, otherwise from where the field of view fits the height.
//
// Lights without names belong to the pictures in filenames.txt, one per line, as in DiLiGenT [Shi et al.
// 2016]; without that list to all pictures of the folder in natural order (2 before 10). Names may differ
// from a picture's in letter case or extension if only one picture fits. A picture whose name ends in "mask"
// is the mask of all photographs. Strengths come from light_intensities.txt beside the light file, r g b per
// line. Otherwise they are unknown: irradiance 1, or for positions one intensity with mean irradiance 1 at
// the origin. With a mirror ball, its pictures and the photographs belong together in natural order, and
// `lights` is not read. Throws Error with the line; throws Cancelled.
ForeignCapture readLitView(const std::filesystem::path& folder, const std::filesystem::path& lights,
                           const LitViewOptions& options, bool allowOutside, const Progress& progress = {});

} // namespace surflect::importers
