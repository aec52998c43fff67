#include "render/method/option.h"

#include "surfel/base/error.h"
#include "surfel/base/text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

namespace surflect::method {

double Value::number() const {
  const double* number = std::get_if<double>(&value_);
  return number ? *number : std::numeric_limits<double>::quiet_NaN();
}

std::string Value::text() const {
  return isNumber() ? fmt::format("{}", number()) : std::get<std::string>(value_);
}

bool Option::isSwitch() const {
  const auto* choices = std::get_if<std::vector<Value>>(&domain);
  return choices && *choices == std::vector<Value>{kOn, kOff};
}

std::string flagOf(std::string_view name) {
  std::string flag = "--" + std::string(name);
  std::ranges::replace(flag, '_', '-');
  return flag;
}

std::string domainText(const Option& option) {
  if (const auto* range = std::get_if<Range>(&option.domain))
    return fmt::format("{:.8g}..{:.8g}{}", range->least, range->most, range->isWhole ? ", whole" : "");
  const auto& choices = std::get<std::vector<Value>>(option.domain);
  std::string text;
  for (size_t i = 0; i < choices.size(); ++i)
    text += (i == 0 ? "" : i + 1 < choices.size() ? ", " : " or ") + choices[i].text();
  return text;
}

namespace {

// Name of the option that a flag or a name means: "--surfel-size" and "surfel_size" are one.
std::string nameOf(std::string_view text) {
  std::string name(text.substr(std::min(text.find_first_not_of('-'), text.size())));
  std::ranges::replace(name, '-', '_');
  return name;
}

bool isIn(const Option& option, const Value& value) {
  if (const auto* choices = std::get_if<std::vector<Value>>(&option.domain))
    return std::ranges::find(*choices, value) != choices->end();
  const Range& range = std::get<Range>(option.domain);
  const double number = value.number(); // NaN is in no range
  return number >= range.least && number <= range.most && (!range.isWhole || number == std::floor(number));
}

// Whether the options that a row needs have one of the values that it needs, or none that is known.
bool hasEffect(const Option& row, const Setting& all) {
  if (!row.needs) return true;
  const auto found = all.find(row.needs->first);
  return found == all.end() || std::ranges::find(row.needs->second, found->second) != row.needs->second.end();
}

void requireValue(const Option& option, const Value& value) {
  if (isIn(option, value)) return;
  std::vector<std::string> words;
  if (const auto* choices = std::get_if<std::vector<Value>>(&option.domain))
    for (const Value& choice : *choices) words.push_back(choice.text());
  const std::vector<std::string_view> known(words.begin(), words.end());
  const std::string found = value.text();
  throw Error::mismatch(domainText(option) + didYouMean(found, known), found).at(flagOf(option.name));
}

} // namespace

const Option& rowOf(const Options& options, std::string_view name) {
  const std::string wanted = nameOf(name);
  const auto found = std::ranges::find(options.rows, wanted, &Option::name);
  if (found != options.rows.end()) return *found;
  std::vector<std::string_view> known;
  for (const Option& row : options.rows) known.push_back(row.name);
  const std::string_view nearest = nearestName(wanted, known);
  throw Error(fmt::format("{} has no option {}{}", options.method, flagOf(wanted),
                          nearest.empty() ? "" : fmt::format("; did you mean {}?", flagOf(nearest))));
}

Value parseValue(const Option& option, std::string_view text) {
  double number = 0;
  const auto [stop, status] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool isNumber = status == std::errc() && stop == text.data() + text.size();
  const Value value = isNumber ? Value(number) : Value(std::string(text));
  requireValue(option, value);
  return value;
}

void requireSetting(const Options& options, const Setting& setting) {
  for (const auto& [name, value] : setting) requireValue(rowOf(options, name), value);
  const Setting all = withDefaults(options.rows, setting);
  for (const auto& [name, value] : setting) {
    const Option& row = rowOf(options, name);
    if (hasEffect(row, all)) continue;
    const auto& [needed, values] = *row.needs;
    std::vector<std::string> words;
    for (const Value& each : values) words.push_back(each.text());
    throw Error(fmt::format("has an effect only with {} {}, found {}", flagOf(needed),
                            fmt::join(words, " or "), all.at(needed).text()))
        .at(flagOf(name));
  }
}

Setting withDefaults(std::span<const Option> rows, Setting setting) {
  for (const Option& row : rows)
    if (row.standard) setting.try_emplace(row.name, *row.standard);
  return setting;
}

Setting withoutDefaults(std::span<const Option> rows, Setting setting) {
  for (const Option& row : rows) {
    const auto found = setting.find(row.name);
    if (found != setting.end() && found->second == row.standard) setting.erase(found);
  }
  return setting;
}

Setting forFrames(std::span<const Option> rows, Setting setting) {
  for (const Option& row : rows)
    if (row.atOpening) setting.erase(row.name);
  return setting;
}

std::vector<Option> sweepable(std::span<const Option> rows, const Setting& given) {
  std::vector<Option> kept;
  for (const Option& row : rows) {
    const bool isNeeded = std::ranges::any_of(rows, [&](const Option& other) {
      return given.contains(other.name) && other.needs && other.needs->first == row.name;
    });
    if (!row.sweep.empty() && !given.contains(row.name) && !isNeeded) kept.push_back(row);
  }
  return kept;
}

std::string textOf(const Setting& setting) {
  std::string text;
  for (const auto& [name, value] : setting)
    text += fmt::format("{}{}={}", text.empty() ? "" : " ", name, value.text());
  return text.empty() ? "full" : text;
}

Setting settingOf(Preset preset, std::span<const Option> rows) {
  Setting setting;
  for (const Option& row : rows) {
    const std::optional<Value>& value = preset == Preset::paper     ? row.paper
                                        : preset == Preset::preview ? row.preview
                                                                    : std::nullopt;
    if (value) setting.emplace(row.name, *value);
  }
  return setting;
}

Setting withPreset(Setting given, Preset preset, std::span<const Option> rows) {
  const Setting presets = settingOf(preset, rows);
  Setting all = given;
  all.insert(presets.begin(), presets.end());
  all = withDefaults(rows, std::move(all));
  for (const Option& row : rows)
    if (const auto found = presets.find(row.name); found != presets.end() && hasEffect(row, all))
      given.insert(*found);
  return given;
}

Sweep parseSweep(const Options& options, std::string_view text) {
  const size_t equals = text.find('=');
  if (equals == 0 || equals == std::string_view::npos || equals + 1 == text.size())
    throw Error::mismatch("NAME=VALUE, or NAME=V1,V2,..", fmt::format("'{}'", text)).at("--sweep");
  const Option& row = rowOf(options, text.substr(0, equals));
  Sweep sweep{row.name, {}};
  for (std::string_view rest = text.substr(equals + 1);;) {
    const size_t comma = rest.find(',');
    sweep.values.push_back(parseValue(row, rest.substr(0, comma)));
    if (comma == std::string_view::npos) return sweep;
    rest.remove_prefix(comma + 1);
  }
}

} // namespace surflect::method
