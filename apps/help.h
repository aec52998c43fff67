// Text of --help.
#pragma once

#include <CLI/CLI.hpp>

#include <string>
#include <vector>

namespace surflect {

// Group of the methods' options: --help lists those of one method at a time, in its footer.
inline constexpr const char* kMethodGroup = "Options of methods";

// Shows what an option takes as N (whole), X, TEXT or its own text, and its default in brackets.
class HelpFormatter : public CLI::Formatter {
public:
  std::string make_group(std::string group, bool isPositional,
                         std::vector<const CLI::Option*> options) const override;
  std::string make_option_opts(const CLI::Option* option) const override;
  std::string make_option_desc(const CLI::Option* option) const override;
  std::string make_expanded(const CLI::App* group) const override; // an option group
};

} // namespace surflect
