// Makes pictures for docs/gallery.md:
//   figures panels < LAYOUT.json
//   figures reflectance-image CAPTURE CAMERA ENVIRONMENT FOLDER
//   figures beside-truth CAPTURE CAMERA LIGHT RENDERING FOLDER
//   figures splats FOLDER
#include "bench/gallery/figures.h"

#include "surfel/base/error.h"

#include <cstdio>
#include <iostream>
#include <string>
#include <vector>

int main(int argc, char** argv) {
  using namespace surflect;
  using namespace surflect::bench;
  const std::vector<std::string> arguments(argv + 1, argv + argc);
  try {
    if (arguments == std::vector<std::string>{"panels"})
      composePanels(std::cin);
    else if (arguments.size() == 5 && arguments[0] == "reflectance-image")
      relightReflectanceImage(arguments[1], arguments[2], arguments[3], arguments[4]);
    else if (arguments.size() == 6 && arguments[0] == "beside-truth")
      writeTruthAndDifference(arguments[1], arguments[2], arguments[3], arguments[4], arguments[5]);
    else if (arguments.size() == 2 && arguments[0] == "splats")
      drawSplats(arguments[1]);
    else
      throw Error(
          "panels < LAYOUT, reflectance-image CAPTURE CAMERA ENVIRONMENT FOLDER, beside-truth CAPTURE CAMERA "
          "LIGHT RENDERING FOLDER, or splats FOLDER");
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "figures: %s\n", error.what());
    return 1;
  }
}
