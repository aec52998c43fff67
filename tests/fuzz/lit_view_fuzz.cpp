#include "srf/import/lit_view.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/fuzz.h"

// A light file, of positions if of kind 'p', for two photographs; and their strengths, if not empty.
void surflect::fuzz_lit_view(std::string_view input) {
  static const FuzzFolder folder;
  const TwoFiles files = twoFilesOf(input);
  importers::LitViewOptions options;
  if (files.kind == 'p') options = {.positions = true, .fieldOfView = Angle::fromDegrees(40)};
  folder.write("a.lp", files.first);
  folder.write("light_intensities.txt", files.second);
  if (files.second.empty()) std::filesystem::remove(folder / "light_intensities.txt");
  importers::readLitView(folder.path(), folder / "a.lp", options, false);
}
