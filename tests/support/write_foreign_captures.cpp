// Writes a capture in other formats, and with two mistakes, for scripts/overlays.
#include "surfel/base/error.h"
#include "tests/support/foreign_captures.h"

#include <cstdio>

int main(int argc, char** argv) try {
  using namespace surflect;
  if (argc != 3) {
    std::fputs("usage: write_foreign_captures CAPTURE FOLDER\n", stderr);
    return 2;
  }
  const std::filesystem::path folder = argv[2];
  const capture::Capture capture = capture::readCapture(argv[1]);
  auto views = photographedByOthers(capture, 0, 3);
  writeColmap(views, folder / "colmap-text", false);
  writeColmap(views, folder / "colmap-binary", true);
  writeBeforeBackdrop(views, Backdrop::table, folder / "before-table");
  writeBeforeBackdrop(views, Backdrop::screen, folder / "before-screen");
  views = photographedByOthers(capture, 1, 3);
  writeNerfstudio(views, folder / "nerfstudio");
  writeMetashape(views, folder / "metashape");
  writeNerfstudio(withYUp(views), folder / "wrong-axes");
  views = photographedByOthers(capture, 2, 3);
  writeMiddlebury(views, folder / "middlebury");
  writeRelighting(views, folder / "nrhints");
  writeRelighting(withMirroredLamps(views), folder / "wrong-lamps");
} catch (const surflect::Error& e) {
  std::fprintf(stderr, "error: %s\n", e.what());
  return 1;
}
