#include "srf/capture/photograph.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/fuzz.h"

#include <algorithm>

void surflect::fuzz(std::string_view input) {
  static const FuzzFolder folder;
  const capture::Capture capture = capture::parseCapture(input, folder / "transforms.json");
  for (size_t frame = 0; frame < std::min<size_t>(capture.frames.size(), 4); ++frame)
    capture::readPhotographs(capture, std::span(&frame, 1));
}
