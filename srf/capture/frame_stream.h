// Parses the JSON of a capture frame by frame: a tree of all frames takes long to build and to free.
#pragma once

#include "srf/capture/json_fields.h"

#include <functional>
#include <string_view>

namespace surflect::capture {

// Calls `begin` with everything but the frames, then `add` with each frame. Returns false if that is not to
// be had in one pass: the text is malformed or nested too deeply, it has no frames, one of them is no object,
// or something follows them. Then parseJson has the answer.
bool streamFrames(std::string_view content, const std::function<void(const Json& root)>& begin,
                  const std::function<void(const Json& frame)>& add);

} // namespace surflect::capture
