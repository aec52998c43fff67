#include "srf/capture/photograph.h"
#include "srf/image/exr.h"
#include "srf/image/png.h"
#include "surfel/file.h"
#include "tests/fuzz/fuzz.h"

#include <stdlib.h>

#include <string>

namespace {

namespace fs = std::filesystem;

// Files for captures to name: pictures of 4 x 3 pixels, and a mesh.
fs::path makeFolder() {
  std::string name = fs::temp_directory_path() / "surflect_fuzz.XXXXXX";
  const fs::path folder = ::mkdtemp(name.data());
  const surflect::Image picture(4, 3, 4);
  surflect::writePng(folder / "a.png", picture);
  surflect::writeExr(folder / "a.exr", picture);
  surflect::writeFileAtomically(folder / "mesh.ply", std::string_view("not read here"));
  return folder;
}

struct Folder {
  fs::path path = makeFolder();
  ~Folder() { fs::remove_all(path); }
};

} // namespace

void surflect::fuzz(std::string_view input) {
  static const Folder folder;
  const Capture capture = parseCapture(input, folder.path / "transforms.json");
  for (size_t frame = 0; frame < std::min<size_t>(capture.frames.size(), 4); ++frame)
    readPhotographs(capture, std::span(&frame, 1));
}
