// Knobs: the parameters of a renderer that trade accuracy for speed.
#pragma once

#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace surflect::knobs {

struct Knob {
  std::string name;           // "cameras"
  std::string meaning;        // one line, for help and reports
  std::vector<double> values; // worth trying: from the most accurate, which is the default, to the fastest
};

// Values of knobs by name. A knob that is not named has its most accurate value.
using Setting = std::map<std::string, double>;

// The setting in one line, as it is given on the command line: "cameras=2 lights=1"; "full" if it is empty.
std::string textOf(const Setting& setting);

struct KnobValues {
  std::string name;
  std::vector<double> values; // at least one
};
// Parses "NAME=V1,V2,..". Throws Error, also for a value that is not finite.
KnobValues parseKnobValues(std::string_view text);

// Throws Error unless `knobs` has all the names of a setting.
void requireKnobs(std::span<const Knob> knobs, const Setting& setting);

} // namespace surflect::knobs
