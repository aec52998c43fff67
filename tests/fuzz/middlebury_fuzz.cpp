#include "srf/import/middlebury.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/fuzz.h"

#include <fstream>

void surflect::fuzz(std::string_view input) {
  static const FuzzFolder folder;
  std::ofstream(folder / "a_par.txt", std::ios::binary) << input;
  readMiddlebury(folder / "a_par.txt", false);
}
