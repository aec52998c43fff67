#include "srf/import/middlebury.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/fuzz.h"

void surflect::fuzz_middlebury(std::string_view input) {
  static const FuzzFolder folder;
  folder.write("a_par.txt", input);
  importers::readMiddlebury(folder / "a_par.txt", false);
}
