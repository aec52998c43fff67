// Options of a method: one row says everything about an option, and flags, help, settings to sweep, presets,
// the identity of frames and the tables of docs/ all come from the rows. They stand in buildRows() and
// renderRows() of each method's NAME_method.cpp (docs/adding.md).
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace surflect::method {

// A number, or one of the words that an option lets choose from.
class Value {
public:
  Value() = default; // 0
  Value(double number) : value_(number) {}
  Value(int number) : value_(static_cast<double>(number)) {}
  Value(size_t number) : value_(static_cast<double>(number)) {}
  Value(const char* word) : value_(word) {}
  Value(std::string word) : value_(std::move(word)) {}

  bool isNumber() const { return std::holds_alternative<double>(value_); }
  // NaN for a word.
  double number() const;
  // As on the command line: "0.05", "kriging".
  std::string text() const;

  friend bool operator==(const Value&, const Value&) = default;
  friend auto operator<=>(const Value&, const Value&) = default;

private:
  std::variant<double, std::string> value_ = 0.0;
};

// Values by the names of options. An option that is not named has its default.
using Setting = std::map<std::string, Value>;

// Numbers that an option can have.
struct Range {
  double least = 0, most = 0;
  bool isWhole = false;
};
inline Range wholeRange(double least, double most) { return {least, most, true}; }

inline constexpr const char *kOn = "on", *kOff = "off";

struct Option {
  std::string name; // "surfel_size"; the flag is --surfel-size
  // Numbers, or numbers and words to choose from, "on" and "off" for a switch.
  std::variant<Range, std::vector<Value>> domain = Range{};
  std::optional<Value> standard = {}; // default; empty if the model or another option decides
  std::optional<Value> paper = {};    // in the preset `paper`, if that differs from the default
  std::optional<Value> preview = {};  // in the preset `preview`, likewise
  // Worth trying for speed: from the most accurate value, which is the default, to the fastest one. Empty:
  // the option does not trade accuracy for speed.
  std::vector<Value> sweep = {};
  std::string help; // one line, without a full stop
  // Another option, and the values of it with which this one has an effect.
  std::optional<std::pair<std::string, std::vector<Value>>> needs = {};
  bool atOpening = false; // given when a model is opened, and kept for all of its frames

  bool isSwitch() const;
};

// "--surfel-size"
std::string flagOf(std::string_view name);
// Text of an option's domain: "0..64", "1..12, whole", "mean or plane".
std::string domainText(const Option& option);

// The options of a method, for messages.
struct Options {
  std::string_view method; // tag: "slf"
  std::span<const Option> rows;
};

// Row of the given name. Throws Error that names the method and its nearest option.
const Option& rowOf(const Options& options, std::string_view name);
// Value of the command line's text. Throws Error naming the option unless it is in the option's domain.
Value parseValue(const Option& option, std::string_view text);
// Throws Error for an option that is not among the rows, for a value outside of a domain, and for an option
// that has no effect beside the others (Option::needs).
void requireSetting(const Options& options, const Setting& setting);

// A setting with the defaults of all rows that have one.
Setting withDefaults(std::span<const Option> rows, Setting setting);
// A setting without the values that are the defaults.
Setting withoutDefaults(std::span<const Option> rows, Setting setting);
// A setting without the options that are given when a model is opened.
Setting forFrames(std::span<const Option> rows, Setting setting);
// The setting in one line: "cameras=2 lights=1"; "full" if it is empty.
std::string textOf(const Setting& setting);

// Options to sweep beside given ones: those with values to sweep that are neither given nor needed by a given
// one.
std::vector<Option> sweepable(std::span<const Option> rows, const Setting& given);

enum class Preset { full, preview, paper };
inline constexpr const char* kPresets[] = {"full", "preview", "paper"};
// Values of a preset. `full`, the default of every option, is empty.
Setting settingOf(Preset preset, std::span<const Option> rows);
// The given values, and those of a preset for other options, unless these have no effect beside the given
// ones.
Setting withPreset(Setting given, Preset preset, std::span<const Option> rows);

// Values to sweep: "NAME=V1,V2,..". Throws Error, also for an option that is not among the rows.
struct Sweep {
  std::string name;
  std::vector<Value> values; // at least one
};
Sweep parseSweep(const Options& options, std::string_view text);

} // namespace surflect::method
