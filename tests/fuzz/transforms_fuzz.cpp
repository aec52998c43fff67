#include "srf/import/transforms.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/fuzz.h"

#include <array>

// Photographs to train with, and others of which the kind tells what they are for; or all in one file.
void surflect::fuzz_transforms(std::string_view input) {
  static const FuzzFolder folder;
  static constexpr std::array others{"transforms_test.json", "transforms_val.json", "transforms_valid.json"};
  const TwoFiles files = twoFilesOf(input);
  const auto kind = static_cast<uint8_t>(files.kind) % (others.size() + 1);
  const bool alone = kind == others.size();
  for (const char* name : others) std::filesystem::remove(folder / name);
  std::filesystem::remove(folder / (alone ? "transforms_train.json" : "transforms.json"));
  folder.write(alone ? "transforms.json" : "transforms_train.json", files.first);
  if (!alone) folder.write(others[kind], files.second);
  importers::readTransforms(folder.path(), false);
}
