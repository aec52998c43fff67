#include "srf/image/png.h"
#include "tests/fuzz/fuzz.h"

#include <cstdlib>

void surflect::fuzz(std::string_view input) {
  const auto path = memoryFile(input);
  const PngPicture picture = readPng(path);
  const PngSize size = readPngSize(path);
  if (size.width != picture.image.width || size.height != picture.image.height) std::abort();
}
