// Notes on the files of a source.
#pragma once

#include "srf/import/foreign_capture.h"
#include "surfel/base/progress.h"

#include <filesystem>
#include <map>

namespace surflect::importers {

// Notes photographs with an EXIF orientation, which is not applied; it matters most if only some of a set
// have one. Orientations are as in Picture.
void noteTurned(const std::map<std::filesystem::path, int>& orientations, ForeignCapture& source);

// Notes pictures beside the photographs that no frame uses, except in mask folders, which findMasks()
// reports. `below`: all folders below the root hold photographs.
void noteUnused(ForeignCapture& source, bool below);

// Notes how masks were interpreted, and probable mistakes (srf/capture/mask_survey.h). Throws Error if
// `inverted` is set but there are no masks, and Cancelled.
void noteMasks(ForeignCapture& source, bool inverted, const Progress& progress);

} // namespace surflect::importers
