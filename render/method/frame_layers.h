// A rendered frame: colour, further layers by name, and what rendering it took.
#pragma once

#include "srf/image/image.h"

#include <map>
#include <optional>
#include <string>

namespace surflect::method {

// Statistics of a frame, from any renderer.
struct FrameReport {
  std::map<std::string, double> seconds;          // per stage; names are the renderer's own
  std::map<std::string, double> processorSeconds; // per stage, of all threads of the process
  // Counts by name: "surfels.dead" is the entry `dead` of the group `surfels`. The group "work" is the
  // estimated cost of each stage, from counts alone and in one unit for a method: equal frames have equal
  // work on every machine. Methods with options to sweep must report it; it must fall where one makes frames
  // faster.
  std::map<std::string, double> counts;
  std::optional<std::string> remark; // a likely mistake, such as an empty picture: one line
};

struct FrameLayers {
  image::Image color; // RGBA, premultiplied
  // AOVs by name (script.h: aovNames); premultiplied but for depth, which is infinite off the object.
  std::map<std::string, image::Image> aovs;
  FrameReport report = {};
};

} // namespace surflect::method
