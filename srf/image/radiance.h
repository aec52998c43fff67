// Radiance pictures (.hdr): four bytes per pixel, three mantissas with one exponent.
#pragma once

#include "srf/image/color.h"
#include "srf/image/image.h"

#include <array>
#include <filesystem>
#include <optional>
#include <string_view>

namespace surflect::image {

struct RadianceHeader {
  int width = 0, height = 0; // of the picture after orientation
  // Order of scanlines; all false for the usual "-Y 2 +X 4".
  bool columns = false;   // "+X 4 -Y 2": scanlines are columns
  bool upwards = false;   // "+Y": the first is the lowest
  bool leftwards = false; // "-X": the first is the rightmost
  // Factor from stored to recorded values: divides out EXPOSURE and COLORCORR.
  std::array<double, 3> factor{1, 1, 1};
  bool isXyz = false;                  // CIE tristimulus values, not RGB
  std::optional<ColorStatement> color; // from PRIMARIES or format XYZE; none: Rec. 709
  size_t bytes = 0;                    // length of the header
};

// Reads the header. Throws Error without the file's name.
RadianceHeader radianceHeader(std::string_view file);

struct RadiancePicture {
  RadianceHeader header;
  // 3 channels, linear, with the primaries of the header. XYZ is converted to Rec. 709 without white
  // adaptation; Radiance's 179 lumens per watt are not divided out.
  Image image;
};

// Throws Error for a damaged file, and for more than 2^28 pixels or 65536 per side.
RadiancePicture readRadiance(const std::filesystem::path& path);

} // namespace surflect::image
