// A rendered frame: colour, further layers by name, and what rendering it took.
#pragma once

#include "srf/image/image.h"

#include <map>
#include <optional>
#include <string>

namespace surflect::render {

// Statistics of a frame, by whichever renderer.
struct FrameReport {
  std::map<std::string, double> seconds;          // per stage; names are the renderer's own
  std::map<std::string, double> processorSeconds; // per stage, of all threads of the process
  std::map<std::string, double> counts;           // by name; "surfels.dead" is the entry dead of a group
  std::optional<std::string> remark;              // a likely mistake, such as an empty picture: one line
};

struct FrameLayers {
  image::Image color; // RGBA, premultiplied
  // By name (script.h: aovNames); premultiplied but for depth, which is infinite off the object.
  std::map<std::string, image::Image> aovs;
  FrameReport report = {};
};

} // namespace surflect::render
