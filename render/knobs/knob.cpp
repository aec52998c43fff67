#include "render/knobs/knob.h"

#include "surfel/base/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace surflect::knobs {

std::string textOf(const Setting& setting) {
  std::string text;
  for (const auto& [name, value] : setting)
    text += fmt::format("{}{}={}", text.empty() ? "" : " ", name, value);
  return text.empty() ? "full" : text;
}

KnobValues parseKnobValues(std::string_view text) {
  const auto complain = [&] {
    return Error::mismatch("NAME=VALUE, or NAME=V1,V2,..", fmt::format("'{}'", text)).at("--knob");
  };
  const size_t equals = text.find('=');
  if (equals == 0 || equals == std::string_view::npos) throw complain();
  KnobValues knob{std::string(text.substr(0, equals)), {}};
  for (const char* next = text.data() + equals; next != text.data() + text.size();) {
    double value = 0;
    const auto [stop, status] = std::from_chars(next + 1, text.data() + text.size(), value);
    if (status != std::errc() || !std::isfinite(value)) throw complain();
    if (stop != text.data() + text.size() && *stop != ',') throw complain();
    knob.values.push_back(value);
    next = stop;
  }
  return knob;
}

void requireKnobs(std::span<const Knob> knobs, const Setting& setting) {
  for (const auto& [name, value] : setting) {
    if (std::ranges::find(knobs, name, &Knob::name) != knobs.end()) continue;
    std::string names;
    for (const Knob& knob : knobs) names += (names.empty() ? "" : ", ") + knob.name;
    throw Error::mismatch(names.empty() ? "no knob: the renderer has none" : "one of " + names,
                          fmt::format("'{}'", name))
        .at("knob");
  }
}

} // namespace surflect::knobs
