#include "apps/help.h"

namespace surflect {

std::string HelpFormatter::make_group(std::string group, bool isPositional,
                                      std::vector<const CLI::Option*> options) const {
  return group == kMethodGroup ? "" : CLI::Formatter::make_group(group, isPositional, options);
}

std::string HelpFormatter::make_option_opts(const CLI::Option* option) const {
  if (!option->get_option_text().empty()) return " " + option->get_option_text();
  if (option->get_expected_max() == 0) return ""; // a flag
  const std::string type = option->get_type_name();
  const auto isA = [&](const char* name) { return type.find(name) != std::string::npos; };
  std::string text = isA("FLOAT") ? " X" : isA("INT") ? " N" : " TEXT";
  for (int i = 1; i < option->get_type_size(); ++i) text += text.substr(0, 2);
  return text;
}

std::string HelpFormatter::make_option_desc(const CLI::Option* option) const {
  std::string text = option->get_description();
  if (const std::string standard = option->get_default_str(); !standard.empty()) {
    const bool isList = standard.front() == '[';
    text += isList ? " " + standard : " [" + standard + "]";
  }
  if (option->get_required() && !option->get_positional()) text += " (required)";
  return text;
}

std::string HelpFormatter::make_expanded(const CLI::App* group) const {
  return make_groups(group, CLI::AppFormatMode::Sub) + "\n";
}

} // namespace surflect
