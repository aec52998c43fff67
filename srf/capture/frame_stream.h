// Parses the JSON of a capture frame by frame: a tree of all frames takes long to build and to free.
#pragma once

#include "srf/capture/json_fields.h"

#include <functional>
#include <string_view>

namespace surflect::capture {

// Calls `begin` with the root, whose list of frames is empty, then `add` with each frame. Returns false if
// one pass does not suffice: the text is malformed or nested too deeply, there are no frames, a frame is no
// object, or a key follows the frames. Then some calls may have been made, and parseJson must be used.
bool streamFrames(std::string_view content, const std::function<void(const Json& root)>& begin,
                  const std::function<void(const Json& frame)>& add);

} // namespace surflect::capture
