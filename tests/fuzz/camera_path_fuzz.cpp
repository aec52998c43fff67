#include "render/scene/camera_path.h"
#include "tests/fuzz/fuzz.h"

void surflect::fuzz_camera_path(std::string_view input) {
  const scene::CameraPath path(memoryFile(input));
  for (const double frame : {0.0, 1.5, 9.0}) path.at(frame);
}
