// Light files of RTI and photometric stereo.
//
// Formats: .lp (the number of photographs, then "file x y z" per line), also without the number, or with bare
// names or ordinals; "x y z" per line; three rows x, y, z with a column per light. x right, y up, z from the
// object to the camera. [HP Labs, "Making PTMs with a .lp File"]
#pragma once

#include "surfel/math/space.h"

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::importers {

// Separators between numbers besides blanks.
inline constexpr std::string_view kLightSeparators = ",;";

// One light of a light file; the name is empty if the file has none.
struct LightEntry {
  std::string name;
  Vec3<double> vector;
  size_t line = 0;
};
// Parses lights whose numbers have decimal points. Throws Error with the line.
std::vector<LightEntry> parseLights(std::string_view content);

// Returns the content with decimal commas replaced by points, of the same length. Decimal commas are a
// convention of the whole file: the last three words of each line, separated by blanks or ";", are numbers
// without a point. Throws Error if some lines have commas and others points, or if commas may be separators.
std::string withDecimalPoints(std::string_view content);

} // namespace surflect::importers
