#include "srf/import/colmap.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/fuzz.h"

// The two files of a model; of kind 't' both are text.
void surflect::fuzz_colmap(std::string_view input) {
  static const FuzzFolder folder;
  const TwoFiles files = twoFilesOf(input);
  const std::string extension = files.kind == 't' ? ".txt" : ".bin",
                    other = files.kind == 't' ? ".bin" : ".txt";
  for (const char* name : {"cameras", "images"}) std::filesystem::remove(folder / (name + other));
  folder.write("cameras" + extension, files.first);
  folder.write("images" + extension, files.second);
  importers::readColmap(folder.path(), folder.path(), false);
}
