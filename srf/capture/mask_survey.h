// Survey of all masks of a capture together, for people, before the capture is used.
#pragma once

#include "srf/capture/capture.h"
#include "surfel/base/progress.h"

#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace surflect::capture {

// Sentences without a full stop, with counts and the first names.
struct MaskSurvey {
  std::vector<std::string> warnings; // what is hardly meant: views without a mask beside views with one;
                                     // masks without object, or all without background; masks whose black
                                     // looks like the object
  std::vector<std::string> notes;    // how masks were understood: as labels, as larger or smaller
};

// Reads all masks or `most`, evenly chosen, several at a time, and headers of pictures that have none. The
// black of masks looks like the object where it is at least twice as rare along the border of the pictures as
// in them, and the border mostly white. `inverted`: black is to be the object. Throws Error for what cannot
// be read, and Cancelled.
MaskSurvey surveyMasks(const Capture& capture, bool inverted, const Progress& progress,
                       size_t most = std::numeric_limits<size_t>::max());

// The first mask or picture with alpha as describeMatte() has it, for messages; none where the capture has no
// mattes on disk. Reads it.
std::optional<std::string> describeFirstMatte(const Capture& capture);

} // namespace surflect::capture
