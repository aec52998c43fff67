// Lights of photographs whose poses come without them: lamps that names of pictures tell, or a flash at the
// camera, whose places may be estimated from shading. COLMAP and nerfstudio know cameras alone.
#pragma once

#include "srf/import/foreign_capture.h"
#include "surfel/base/time.h"
#include "surfel/math/space.h"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace surflect::importers {

struct LampOptions {
  // Names of pictures below the source's folder of pictures: "{camera}/{light}.jpg". Empty: none.
  std::string pattern;
  std::filesystem::path lights; // table of the lamps: "name x y z" lines, as parseLights() reads them
  bool positions = false;       // the table gives positions in scene units, not directions towards the lamps
  bool findLamps = false;       // the places of the lamps are estimated from shading, and no table is read
  // Names of registered pictures that were taken where a lamp stands: "lamps/{light}.jpg". Empty: none.
  std::string lampImages;
  // Folder of pictures of a mirror ball where the object stands, named as the photographs. Empty: none.
  std::filesystem::path chromeBall;
  // Place of a flash from the camera: to the right, up and backwards, in scene units.
  std::optional<Vec3<double>> flash;
  bool findFlash = false; // the place of a flash is estimated from shading

  bool isGiven() const { return !pattern.empty() || flash.has_value() || findFlash; }
};

// Camera and light that a picture's name tells.
struct LitName {
  std::string camera, light;
};
// Matches a picture's name with a pattern; empty if it does not fit. Neither camera nor light contains a
// slash; the first of them is as short as it can be. Throws Error unless the pattern has {camera} and {light}
// once each.
std::optional<LitName> matched(std::string_view pattern, std::string_view name);

// Gives the photographs of a source under fixed light their lights; lights that the source lists, and that no
// photograph names, are dropped. With a pattern, every picture that fits it and whose camera has a registered
// picture becomes a photograph. The pose of a camera is the mean of its registered pictures' poses; a note
// tells if these differ. Strengths are taken as equal. Until placeLamps() estimates places, a flash stands at
// its camera, and lamps have no place. Throws Error; throws Cancelled while pictures of a mirror ball are
// read.
void giveLights(ForeignCapture& source, const LampOptions& options, const Progress& progress = {});

// Estimates the places that the options ask for, from the photographs and the capture's geometry
// (srf/calibration/lamp_places.h). Of lamps in the world also relative strengths; one that is too far away
// for a place becomes a direction. Notes tell results and their standard errors. Throws Error without a
// geometry, and where the photographs do not determine places; throws Cancelled. Progress names the stages
// "shading" (photographs are read, up to eight of a lamp or 96 of a flash) and "lamps" (places are fitted).
void placeLamps(ForeignCapture& source, const LampOptions& options, const Progress& progress = {});

} // namespace surflect::importers
