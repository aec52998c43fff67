#include "apps/option_values.h"

#include <fmt/format.h>

namespace surflect {

CLI::Validator finiteIn(double least, double most) {
  const auto problem = [=](const std::string& text) -> std::string {
    double x = 0;
    if (CLI::detail::lexical_cast(text, x) && x >= least && x <= most) return "";
    return fmt::format("Value {} not in range {} to {}", text, least, most);
  };
  return {problem, fmt::format("FLOAT in [{:g} - {:g}]", least, most), ""};
}

} // namespace surflect
