// Frames that a command takes from a script.
#pragma once

#include "render/scene/script.h"

#include <string>

namespace surflect {

struct FrameRange {
  int first, last;
};

// Parses "7" or "3-12", inside the script's frames; empty: all of them. Throws Error.
FrameRange parseRange(const std::string& text, const scene::Frames& frames);

} // namespace surflect
