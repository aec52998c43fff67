#include "srf/import/metashape.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/fuzz.h"

void surflect::fuzz_metashape(std::string_view input) {
  static const FuzzFolder folder;
  folder.write("cameras.xml", input);
  importers::readMetashape(folder / "cameras.xml", {});
}
