// Estimated work of a frame, from what it counts rather than from a clock.
#pragma once

#include "render/surfels/frame.h"

#include <map>
#include <string>

namespace surflect::surfels {

// Nanoseconds of one typical core by stage: rough, but the same on every machine, for any number of threads
// and any cache. For choosing between settings.
std::map<std::string, double> workOf(const FrameStats& stats, const FrameOptions& options, size_t pixels);

} // namespace surflect::surfels
