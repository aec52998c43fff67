#include "apps/option_values.h"

#include "surfel/math/simd.h"

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
      ->check(CLI::IsMember(names));
}

} // namespace surflect
