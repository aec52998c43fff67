// Checks all masks of a capture before it is used, and reports to people.
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
  std::vector<std::string>
      warnings; // probable mistakes: views without a mask beside views with one; masks without object;
                // captures whose masks have no background; masks that look inverted
  std::vector<std::string> notes; // how masks were interpreted: as labels, as resized
};

// Reads all masks or `most`, evenly chosen, several at a time, and headers of pictures that have none. Masks
// look inverted if the border of the pictures is mostly white, and black at least twice as rare there as in
// the whole picture. `inverted`: black is the object. Throws Error for unreadable files, and Cancelled.
MaskSurvey surveyMasks(const Capture& capture, bool inverted, const Progress& progress,
                       size_t most = std::numeric_limits<size_t>::max());

// Description by describeMatte() of the first mask or picture with alpha, for messages; none if the capture
// has no mattes.
std::optional<std::string> describeFirstMatte(const Capture& capture);

} // namespace surflect::capture
