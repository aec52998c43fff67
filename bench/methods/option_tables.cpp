// Tables of the methods' options for docs/, from their rows: prints JSON of Markdown by "pack METHOD" and
// "render METHOD". scripts/options writes them between marks.
#include "render/methods.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cstdio>

namespace surflect::bench {

namespace {

using method::Option, method::Value;

std::string tableOf(const std::vector<Option>& options) {
  const auto textOr = [](const std::optional<Value>& value) { return value ? value->text() : ""; };
  std::string text = "| option | values | default | paper | preview | meaning |\n|---|---|---|---|---|---|\n";
  for (const Option& option : options)
    text += fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", method::flagOf(option.name),
                        method::domainText(option), textOr(option.standard), textOr(option.paper),
                        textOr(option.preview), option.help);
  return text;
}

} // namespace
} // namespace surflect::bench

int main() {
  nlohmann::ordered_json tables;
  for (const surflect::method::Method& method : surflect::method::methods()) {
    tables["pack " + method.tag] = surflect::bench::tableOf(method.buildOptions);
    tables["render " + method.tag] = surflect::bench::tableOf(method.renderOptions);
  }
  std::puts(tables.dump(2).c_str());
}
