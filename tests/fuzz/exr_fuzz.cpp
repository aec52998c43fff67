#include "srf/image/exr.h"
#include "tests/fuzz/fuzz.h"

void surflect::fuzz_exr(std::string_view input) {
  const image::ExrFile file(memoryFile(input));
  file.attribute("surflect.identity");
  file.read(file.channels());
}
