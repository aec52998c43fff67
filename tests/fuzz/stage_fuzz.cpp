#include "render/stage/stage_file.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/fuzz.h"

#include <algorithm>
#include <cctype>

namespace {

// Fine meshes are valid, and take all the time: at most two digits of what makes them so are looked at.
bool asksForFineMesh(std::string_view text) {
  const auto isWord = [&](size_t i) {
    return i < text.size() && (std::isalnum(static_cast<unsigned char>(text[i])) || text[i] == '_');
  };
  for (const std::string_view key : {"segments", "turns", "fibres", "hairs", "ring"})
    for (size_t at = text.find(key); at != text.npos; at = text.find(key, at + 1)) {
      size_t digit = std::min(text.find('=', at), text.size());
      while (++digit < text.size() && text[digit] == ' ') continue;
      if (isWord(digit) && isWord(digit + 1) && isWord(digit + 2)) return true;
    }
  return false;
}

} // namespace

// A mesh, a picture, a response curve and a rig lie beside the stage file.
void surflect::fuzz(std::string_view input) {
  static const FuzzFolder folder;
  static const bool isFurnished = [] {
    folder.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    std::string curve;
    for (int code = 0; code < 256; ++code) curve += std::to_string(code) + " ";
    folder.write("curve.txt", curve);
    folder.write("rig.json", R"({"w": 4, "h": 3, "fl_x": 5,
      "lights": [{"name": "L", "type": "directional", "direction": [0, 0, 1], "irradiance": [1, 1, 1]}],
      "frames": [{"file_path": "a.png", "light": "L",
                  "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]]}]})");
    return true;
  }();
  if (isFurnished && !asksForFineMesh(input)) parseStage(input, folder / "stage.toml");
}
