#include "render/stage/stage_file.h"
#include "tests/fuzz/folder.h"
#include "tests/fuzz/fuzz.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string>

namespace {

// Calls visit() with the word after each "key =" in a text.
template <class Visit> void forEachValue(std::string_view text, std::string_view key, Visit visit) {
  const auto isWord = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) ||
           std::string_view("_.+-").find(c) != std::string_view::npos;
  };
  for (size_t at = text.find(key); at != text.npos; at = text.find(key, at + 1)) {
    const size_t equals = text.substr(at, key.size() + 32).find('=');
    if (equals == text.npos) continue;
    size_t begin = at + equals;
    while (++begin < text.size() && (text[begin] == ' ' || text[begin] == '\t')) continue;
    begin = std::min(begin, text.size());
    size_t end = begin;
    while (end < text.size() && isWord(text[end])) ++end;
    visit(text.substr(begin, end - begin));
  }
}

// Fine meshes and many views are valid, and take all the time: counts of two digits from 40 on, and of more
// digits, are not looked at; of what a braid or fur is made of not more than 9.
bool asksForMuch(std::string_view text) {
  bool much = false;
  for (const std::string_view key : {"segments", "count", "turntable", "test"})
    forEachValue(text, key, [&](std::string_view value) {
      much = much || value.size() > 2 || (value.size() == 2 && value[0] > '3' && value[0] <= '9');
    });
  for (const std::string_view key : {"turns", "fibres", "hairs", "ring"})
    forEachValue(text, key, [&](std::string_view value) { much = much || value.size() > 1; });
  return much;
}

// Valid are also the tables of what rough metal, glass and coats lose, which take seconds to make. Ward's
// model has a roughness too, and none.
bool asksForTable(std::string_view text) {
  bool isRough = false;
  forEachValue(text, "alpha", [&](std::string_view value) { isRough = isRough || value != "0"; });
  return isRough && std::ranges::any_of(std::array{"conductor", "dielectric", "clear_coat"},
                                        [&](std::string_view type) { return text.find(type) != text.npos; });
}

} // namespace

// A mesh, a picture, a response curve and a rig lie beside the stage file.
void surflect::fuzz_stage(std::string_view input) {
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
  // Shapes that do not say have few segments, too.
  if (isFurnished && !asksForMuch(input) && !asksForTable(input))
    stage::parseStage("segments = 6\n" + std::string(input), folder / "stage.toml");
}
