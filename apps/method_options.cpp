#include "apps/method_options.h"

#include "apps/help.h"
#include "render/scene/script.h"
#include "surfel/base/text.h"
#include "surfel/math/simd.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace surflect {

CLI::Validator finiteIn(double least, double most) {
  const auto problem = [=](const std::string& text) -> std::string {
    double x = 0;
    if (CLI::detail::lexical_cast(text, x) && x >= least && x <= most) return "";
    return fmt::format("Value {} not in range {} to {}", text, least, most);
  };
  return {problem, fmt::format("FLOAT in [{:g} - {:g}]", least, most), ""};
}

CLI::Validator oneOf(std::vector<std::string> words) {
  const auto problem = [words](const std::string& text) -> std::string {
    if (std::ranges::find(words, text) != words.end()) return "";
    const std::vector<std::string_view> known(words.begin(), words.end());
    return fmt::format("found '{}', expected {}{}", text, fmt::join(words, ", "), didYouMean(text, known));
  };
  return {problem, fmt::format("{}", fmt::join(words, "|")), ""};
}

void addSimd(CLI::App& command) {
  std::vector<std::string> names{"auto"};
  for (const Simd supported : supportedSimd()) names.emplace_back(nameOf(supported));
  command
      .add_option_function<std::string>(
          "--simd",
          [](const std::string& name) {
            for (const Simd supported : supportedSimd())
              if (name == nameOf(supported)) useSimd(supported);
          },
          "vector instructions; default: auto, the best that the processor has")
      ->option_text("auto, scalar, avx2 or avx512")
      ->check(oneOf(names));
}

using method::Method, method::Option, method::Setting, method::Value;

namespace {

// Whether the flag alone switches the option on.
bool isPlainFlag(const Option& option) { return option.isSwitch() && option.standard == Value(method::kOff); }

std::string valueName(const Option& option) {
  if (isPlainFlag(option)) return "";
  if (std::holds_alternative<method::Range>(option.domain))
    return std::get<method::Range>(option.domain).isWhole ? "N" : "X";
  std::string words;
  for (const Value& choice : std::get<std::vector<Value>>(option.domain))
    words += (words.empty() ? "" : "|") + choice.text();
  return words;
}

std::string defaultText(const Option& option) {
  if (!option.standard) return "";
  return isPlainFlag(option) ? "" : option.standard->text();
}

// Lines of at most `width` letters, all but the first indented.
std::string wrapped(const std::string& text, size_t indent, size_t width) {
  std::string lines;
  size_t at = indent;
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = std::min(text.find(' ', begin), text.size());
    if (at + end - begin > width && at > indent) {
      lines += "\n" + std::string(indent, ' ');
      at = indent;
    } else if (at > indent) {
      lines += ' ';
      ++at;
    }
    lines += text.substr(begin, end - begin);
    at += end - begin;
    begin = end + 1;
  }
  return lines;
}

} // namespace

std::string optionTable(std::span<const Option> options) {
  constexpr size_t kColumn = 30, kWidth = 100;
  std::string text;
  for (const Option& option : options) {
    std::string flag = "  " + method::flagOf(option.name) + " " + valueName(option);
    flag += flag.size() + 1 < kColumn ? std::string(kColumn - flag.size(), ' ')
                                      : "\n" + std::string(kColumn, ' ');
    std::string help = option.help;
    if (const auto* range = std::get_if<method::Range>(&option.domain))
      help += fmt::format(" ({:.8g}..{:.8g})", range->least, range->most);
    if (const std::string standard = defaultText(option); !standard.empty()) help += " [" + standard + "]";
    text += flag + wrapped(help, kColumn, kWidth) + "\n";
  }
  return text;
}

void MethodOptions::add(CLI::App& command, Kind kind, std::function<const Method*()> shown) {
  kind_ = kind;
  command
      .add_option(
          "--preset", preset_,
          "values of all options that are not given: the most accurate, a fast preview, or the method "
          "as its paper prints it")
      ->option_text("full, preview or paper")
      ->default_str("full")
      ->check(oneOf({std::begin(method::kPresets), std::end(method::kPresets)}));
  for (const Method& method : method::methods())
    for (const Option& option : rowsOf(method))
      if (!command.get_option_no_throw(method::flagOf(option.name))) addFlag(command, option);
  const std::string name = command.get_name();
  command.footer([this, name, shown] {
    std::string text;
    if (const Method* method = shown()) {
      text = fmt::format("Options of {} ({}):\n{}", method->tag, method->paper, optionTable(rowsOf(*method)));
    } else {
      text = "Options of the methods:\n";
      for (const Method& each : method::methods()) {
        std::string flags;
        for (const Option& option : rowsOf(each)) flags += method::flagOf(option.name) + " ";
        text += fmt::format("  {:<12}{}\n", each.tag, wrapped(flags, 14, 100));
      }
      text += kind_ == Kind::build ? "surflect pack --method METHOD --help explains them.\n"
                                   : fmt::format("surflect {} MODEL --help explains them.\n", name);
    }
    return text;
  });
}

std::vector<CLI::Option*> MethodOptions::add(CLI::App& command, const Method& method,
                                             std::span<const std::string_view> names) {
  kind_ = Kind::build;
  std::vector<CLI::Option*> flags;
  for (const std::string_view name : names)
    for (CLI::Option* flag : addFlag(command, method::rowOf({method.tag, method.buildOptions}, name))) {
      flag->group("Options");
      flags.push_back(flag);
    }
  return flags;
}

std::vector<CLI::Option*> MethodOptions::addFlag(CLI::App& command, const Option& option) {
  const std::string flag = method::flagOf(option.name), name = option.name;
  if (isPlainFlag(option))
    return {command
                .add_flag_callback(
                    flag, [this, name] { given_[name] = method::kOn; }, option.help)
                ->group(kMethodGroup)};
  return {command
              .add_option_function<std::string>(
                  flag, [this, name](const std::string& text) { given_[name] = text; }, option.help)
              ->check([this, name](const std::string& text) { return problemOf(name, text); })
              ->option_text(valueName(option))
              ->group(kMethodGroup)};
}

std::string MethodOptions::problemOf(const std::string& name, const std::string& text) const {
  std::vector<std::string> domains, words; // of the methods that have the option
  for (const Method& method : method::methods())
    for (const Option& option : rowsOf(method)) {
      if (option.name != name) continue;
      try {
        method::parseValue(option, text);
        return "";
      } catch (const Error&) {
        if (const std::string domain = method::domainText(option);
            std::ranges::find(domains, domain) == domains.end())
          domains.push_back(domain);
        if (const auto* choices = std::get_if<std::vector<Value>>(&option.domain))
          for (const Value& choice : *choices) words.push_back(choice.text());
      }
    }
  const std::vector<std::string_view> known(words.begin(), words.end());
  return fmt::format("found {}, expected {}{}", text, fmt::join(domains, "; or "), didYouMean(text, known));
}

std::span<const Option> MethodOptions::rowsOf(const Method& method) const {
  return kind_ == Kind::build ? method.buildOptions : method.renderOptions;
}

method::Preset MethodOptions::preset() const {
  return static_cast<method::Preset>(std::ranges::find(method::kPresets, preset_) -
                                     std::begin(method::kPresets));
}

Setting MethodOptions::settingFor(const Method& method) const {
  const Method* const one[] = {&method};
  return settingsFor(one).at(method.tag);
}

std::map<std::string, Setting> MethodOptions::settingsFor(std::span<const Method* const> methods) const {
  try {
    std::map<std::string, Setting> settings;
    std::map<std::string, size_t> takers;
    for (const Method* method : methods) {
      const method::Options options{method->tag, rowsOf(*method)};
      Setting setting;
      for (const auto& [name, text] : given_) {
        if (std::ranges::find(options.rows, name, &Option::name) == options.rows.end()) continue;
        setting.insert_or_assign(name, method::parseValue(method::rowOf(options, name), text));
        ++takers[name];
      }
      if (kind_ == Kind::build && method->checkBuild) method->checkBuild(setting); // presets go together
      setting = method::withPreset(std::move(setting), preset(), options.rows);
      method::requireSetting(options, setting);
      settings[method->tag] = std::move(setting);
    }
    for (const auto& [name, text] : given_)
      if (!takers.contains(name)) method::rowOf({methods.front()->tag, rowsOf(*methods.front())}, name);
    return settings;
  } catch (const Error& error) {
    throw UsageError(error);
  }
}

const Method* methodAt(const std::string& path) {
  if (path.empty()) return nullptr;
  try {
    if (std::filesystem::is_directory(path)) return &method::methodOfModel(path);
    const scene::ScriptHead head = scene::readScriptHead(path);
    return &method::methodOfModel(head.objects.empty() ? head.model : head.objects.front().model);
  } catch (const Error&) {
    return nullptr;
  }
}

namespace {

Json numberJson(double number) {
  if (number == std::floor(number) && std::abs(number) < 9e15) return static_cast<int64_t>(number);
  return number;
}

} // namespace

Json jsonOf(const Setting& setting) {
  Json json = Json::object();
  for (const auto& [name, value] : setting)
    json[name] = value.isNumber() ? numberJson(value.number()) : Json(value.text());
  return json;
}

Json countsJson(const std::map<std::string, double>& counts) {
  Json json = Json::object();
  for (const auto& [name, value] : counts) {
    const size_t dot = name.find('.');
    Json& entry = dot == std::string::npos ? json[name] : json[name.substr(0, dot)][name.substr(dot + 1)];
    entry = numberJson(value);
  }
  return json;
}

} // namespace surflect
