#include "srf/image/exr.h"
#include "tests/fuzz/fuzz.h"

void surflect::fuzz(std::string_view input) {
  const image::ExrFile file(memoryFile(input));
  file.attribute("surflect.identity");
  file.read(file.channels());
}
