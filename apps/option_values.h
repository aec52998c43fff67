// Validators for option values; a violation is a usage error.
#pragma once

#include <CLI/CLI.hpp>

#include <cstdint>
#include <string>

namespace surflect {

// Finite numbers in a range; CLI::Range alone accepts NaN.
CLI::Validator finiteIn(double least, double most);

// Whole numbers in a range. Signed, so that negative input is not wrapped around.
inline CLI::Validator wholeIn(int64_t least, int64_t most) { return CLI::Range(least, most); }

// Adds --simd.
void addSimd(CLI::App& command);

// Frame number of a script, possibly between two frames.
inline CLI::Validator frameNumber() { return finiteIn(-1e9, 1e9); }

// Path to write to; rejects empty names, such as those of unset shell variables.
inline CLI::Validator notEmpty() {
  return {[](const std::string& text) -> std::string { return text.empty() ? "An empty name" : ""; }, "", ""};
}

} // namespace surflect
