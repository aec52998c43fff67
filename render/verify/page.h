// Report of `verify` as a web page: what is out of bounds, what to do, and a picture a frame.
#pragma once

#include "render/verify/exactness.h"
#include "render/verify/frame_checks.h"

#include <string>
#include <vector>

namespace surflect::verify {

struct FrameReport {
  int frame = 0;
  FrameFindings findings;
};

struct Report {
  std::string title, command; // name of the model; the command that made the report
  std::vector<Check> model;
  Exactness exactness;
  std::vector<FrameReport> frames;

  size_t broken() const; // over model, exactness and frames
};

// File name of a frame's overlay.
std::string overlayName(int frame);

// The page; overlays lie beside it under their names.
std::string pageOf(const Report& report);

} // namespace surflect::verify
