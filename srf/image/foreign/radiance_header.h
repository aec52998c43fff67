// The text before the pixels of a Radiance picture (.hdr), of which OpenImageIO passes on only a part.
//   [Ward: Radiance file formats, "Picture Files"]
#pragma once

#include "srf/image/image.h"

namespace surflect {

struct RadianceHeader {
  double exposure = 1; // what radiances have been multiplied by: EXPOSURE lines add up to their product
  // How scanlines follow each other; a usual picture, "-Y 2 +X 4", is none of these.
  bool columns = false;   // "+X 4 -Y 2": scanlines are columns
  bool upwards = false;   // "+Y": the first is the lowest
  bool leftwards = false; // "-X": the first is the rightmost
};

// Throws Error without the file's name.
RadianceHeader readRadianceHeader(const char* path);

// Of pixels as scanlines have them: the picture as it is looked at, in radiance.
Image asPhotographed(const Image& scanlines, const RadianceHeader& header);

} // namespace surflect
