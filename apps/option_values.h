// What the values of options can be; else the usage is wrong.
#pragma once

#include <CLI/CLI.hpp>

#include <cstdint>
#include <string>

namespace surflect {

// CLI::Range, which lets NaN pass, for numbers.
CLI::Validator finiteIn(double least, double most);

// Signed, so that what is below 0 does not come round as something large.
inline CLI::Validator wholeIn(int64_t least, int64_t most) { return CLI::Range(least, most); }

// Frames of a script, which can be between two.
inline CLI::Validator frameNumber() { return finiteIn(-1e9, 1e9); }

// Names of what is written: an empty one, such as a variable of the shell that is not set, names nothing.
inline CLI::Validator notEmpty() {
  return {[](const std::string& text) -> std::string { return text.empty() ? "An empty name" : ""; }, "", ""};
}

} // namespace surflect
