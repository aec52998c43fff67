#include "srf/import/colmap.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/fuzz.h"

#include <fstream>

// The two files of a model, one after the other: the first three characters say of how many bytes the first
// is, and a fourth, 't' or another, whether both are text.
void surflect::fuzz(std::string_view input) {
  static const FuzzFolder folder;
  if (input.size() < 4) return;
  size_t split = 0;
  for (const char digit : input.substr(0, 3)) split = 10 * split + static_cast<uint8_t>(digit - '0') % 10;
  const std::string extension = input[3] == 't' ? ".txt" : ".bin", other = input[3] == 't' ? ".bin" : ".txt";
  const std::string_view files = input.substr(4);
  split = std::min(split, files.size());
  for (const char* name : {"cameras", "images"}) std::filesystem::remove(folder / (name + other));
  std::ofstream(folder / ("cameras" + extension), std::ios::binary) << files.substr(0, split);
  std::ofstream(folder / ("images" + extension), std::ios::binary) << files.substr(split);
  readColmap(folder.path(), folder.path(), false);
}
