// Estimated work of a frame, from what it counts rather than from a clock.
#pragma once

#include "render/surfels/frame.h"

#include <map>
#include <string>

namespace surflect::surfels {

// Work by stage, in nanoseconds of one typical core: rough, but the same on every machine, for any number of
// threads and any cache. It serves to choose between settings.
std::map<std::string, double> workOf(const FrameStats& stats, const FrameOptions& options, size_t pixels);

} // namespace surflect::surfels
