#include "srf/capture/json_fields.h"
#include "srf/capture/photograph.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/fuzz.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdlib>

namespace {

using namespace surflect;

// Whatever is read frame by frame must be the whole tree.
void compareWithTree(std::string_view input) {
  capture::Json whole, frames = capture::Json::array();
  if (!capture::streamFrames(
          input, [&](const capture::Json& root) { whole = root; },
          [&](const capture::Json& frame) { frames.push_back(frame); }))
    return;
  whole["frames"] = std::move(frames);
  if (whole != capture::parseJson(input)) std::abort();
}

} // namespace

void surflect::fuzz_capture(std::string_view input) {
  compareWithTree(input);
  static const FuzzFolder folder;
  const capture::Capture capture = capture::parseCapture(input, folder / "transforms.json");
  for (size_t frame = 0; frame < std::min<size_t>(capture.frames.size(), 4); ++frame)
    capture::readPhotographs(capture, std::span(&frame, 1));
}
