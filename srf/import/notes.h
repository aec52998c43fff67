// Adds notes on the files of a source.
#pragma once

#include "srf/import/source.h"
#include "surfel/base/progress.h"

#include <filesystem>
#include <map>

namespace surflect::importers {

// Photographs that EXIF would have turned are not, which matters most where it turns some of a set. Their
// orientations are as in Picture.
void noteTurned(const std::map<std::filesystem::path, int>& orientations, Source& source);

// Notes pictures beside the photographs that no frame uses, except in folders of masks, which findMasks()
// reports. `below`: all folders below the root hold photographs.
void noteUnused(Source& source, bool below);

// How masks were understood, and what about them is hardly meant (srf/capture/mask_survey.h). Throws Error
// where they are to be inverted and there are none, and Cancelled.
void noteMasks(Source& source, bool inverted, const Progress& progress);

} // namespace surflect::importers
