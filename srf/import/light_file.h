// Light files of RTI and photometric stereo, as text.
//
// .lp (the number of photographs, then "file x y z" a line), the same without the number, or with names, or
// ordinals, of photographs; "x y z" a line; or the three rows x, y, z, one column a light. x to the right, y
// up, z from the object to the camera. [HP Labs, "Making PTMs with a .lp File"]
#pragma once

#include "surfel/math/space.h"

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::importers {

// Blanks, too, stand between numbers.
inline constexpr std::string_view kLightSeparators = ",;";

// One light of a light file. The name is empty where the file has none.
struct LightEntry {
  std::string name;
  Vec3<double> vector;
  size_t line = 0;
};
// Numbers have decimal points. Throws Error with the line.
std::vector<LightEntry> parseLights(std::string_view content);

// The content with points for its decimal commas, of the same length; as it is where it has none. Decimal
// commas are a convention of the whole file: every line's last three words, separated by blanks or ";", are
// numbers, and none has a point. Throws Error where some lines have commas and others points, or where commas
// can be separators as well.
std::string withDecimalPoints(std::string_view content);

} // namespace surflect::importers
