// Flags of the methods' options, made from their rows (render/method/option.h).
#pragma once

#include "apps/command.h"
#include "render/methods.h"

#include <CLI/CLI.hpp>

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace surflect {

// Validators for option values; a violation is a usage error.

// Finite numbers in a range; CLI::Range alone accepts NaN.
CLI::Validator finiteIn(double least, double most);

// Whole numbers in a range. Signed, so that negative input is not wrapped around.
inline CLI::Validator wholeIn(int64_t least, int64_t most) { return CLI::Range(least, most); }

// One of the words; the error suggests the nearest.
CLI::Validator oneOf(std::vector<std::string> words);

// Adds --simd.
void addSimd(CLI::App& command);

// Frame number of a script, possibly between two frames.
inline CLI::Validator frameNumber() { return finiteIn(-1e9, 1e9); }

// Path to write to; rejects empty names, such as those of unset shell variables.
inline CLI::Validator notEmpty() {
  return {[](const std::string& text) -> std::string { return text.empty() ? "An empty name" : ""; }, "", ""};
}

// A mistake on the command line that can be found only when a model is known: the program exits with 2.
class UsageError : public Error {
public:
  explicit UsageError(const Error& error) : Error(error) {}
};

class MethodOptions {
public:
  enum class Kind { build, render };

  // Adds --preset, and a flag for each option that any method has; a method is known only when the command
  // runs. `shown` returns the method whose options --help lists, or null for a line a method. The object must
  // outlive the command.
  void add(CLI::App& command, Kind kind, std::function<const method::Method*()> shown);
  // Adds the flags of some options of one method; returns them.
  std::vector<CLI::Option*> add(CLI::App& command, const method::Method& method,
                                std::span<const std::string_view> names);

  bool isGiven(const std::string& name) const { return given_.contains(name); }
  // The given values for a method, over those of the preset. Throws UsageError for an option that the method
  // lacks, and for values that it cannot take.
  method::Setting settingFor(const method::Method& method) const;
  // Likewise for several methods side by side: each takes the options that it has. Throws UsageError for an
  // option that none of them has.
  std::map<std::string, method::Setting> settingsFor(std::span<const method::Method* const> methods) const;

private:
  std::vector<CLI::Option*> addFlag(CLI::App& command, const method::Option& option);
  // Complaint about a value that no method takes; empty if one that has the option does.
  std::string problemOf(const std::string& name, const std::string& text) const;
  std::span<const method::Option> rowsOf(const method::Method& method) const;
  method::Preset preset() const;

  Kind kind_ = Kind::render;
  std::string preset_ = method::kPresets[0];
  std::map<std::string, std::string> given_; // texts by name
};

// The method of a model, script or neither, for --help: null if it cannot be told.
const method::Method* methodAt(const std::string& path);

// Table of options as --help and docs/ show it, a line each: flag, values, default, help.
std::string optionTable(std::span<const method::Option> options);
// A setting as JSON, an entry an option.
Json jsonOf(const method::Setting& setting);
// Counts that belong to a group become an object of their own; whole numbers are written without a point.
Json countsJson(const std::map<std::string, double>& counts);

} // namespace surflect
