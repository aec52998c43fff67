// Radiance pictures (.hdr): four bytes a pixel, three mantissas with one exponent.
#pragma once

#include "srf/image/color_encoding.h"
#include "srf/image/image.h"

#include <array>
#include <filesystem>
#include <optional>
#include <string_view>

namespace surflect::image {

struct RadianceHeader {
  int width = 0, height = 0; // of the picture as it is looked at
  // How scanlines follow each other; a usual picture, "-Y 2 +X 4", is none of these.
  bool columns = false;   // "+X 4 -Y 2": scanlines are columns
  bool upwards = false;   // "+Y": the first is the lowest
  bool leftwards = false; // "-X": the first is the rightmost
  // Stored values times this are the recorded ones: EXPOSURE and COLORCORR divided out.
  std::array<double, 3> factor{1, 1, 1};
  bool isXyz = false;                  // CIE tristimulus values, not RGB
  std::optional<ColorStatement> color; // of PRIMARIES, or of format XYZE; none: Rec. 709
  size_t bytes = 0;                    // of the header
};

// Throws Error without the file's name.
RadianceHeader radianceHeader(std::string_view file);

struct RadiancePicture {
  RadianceHeader header;
  // 3 channels, linear, of the primaries that the header states. XYZ has become Rec. 709, colour by colour:
  // white is not adapted, and Radiance's 179 lumens a watt are not divided out.
  Image image;
};

// Throws Error for what is damaged, and for more than 2^28 pixels or 65536 a side.
RadiancePicture readRadiance(const std::filesystem::path& path);

} // namespace surflect::image
