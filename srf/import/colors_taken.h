// Reports how a capture's pictures will be read: as which colours, and why.
#pragma once

#include "srf/capture/capture.h"
#include "surfel/base/progress.h"

#include <string>

namespace surflect::importers {

// "colour: 16 pictures as sRGB (PNG sRGB chunk), 2 as gamma 2.2 (PNG gAMA chunk)". Reads headers only. Throws
// Error naming the picture for a statement that cannot be understood, and for an EXR without the
// requested layer.
std::string colorsTaken(const capture::Capture& capture, const Progress& progress);

} // namespace surflect::importers
