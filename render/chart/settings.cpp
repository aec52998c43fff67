#include "render/chart/settings.h"

#include <algorithm>
#include <optional>

namespace surflect::chart {

method::Setting withoutFull(std::span<const method::Option> knobs, method::Setting setting) {
  for (const method::Option& knob : knobs) {
    const auto found = setting.find(knob.name);
    if (found == setting.end()) continue;
    const std::optional<method::Value> full =
        knob.sweep.empty() ? knob.standard : std::optional(knob.sweep.front());
    if (found->second == full) setting.erase(found);
  }
  return setting;
}

std::vector<method::Setting> combinations(std::span<const method::Option> knobs) {
  std::vector<method::Setting> settings{{}};
  for (const method::Option& knob : knobs) {
    std::vector<method::Setting> longer;
    for (const method::Setting& setting : settings)
      for (const method::Value& value : knob.sweep) {
        longer.push_back(setting);
        longer.back()[knob.name] = value;
      }
    settings = std::move(longer);
  }
  return settings;
}

std::vector<method::Setting> oneByOne(std::span<const method::Option> knobs) {
  std::vector<method::Setting> settings{{}};
  for (const method::Option& knob : knobs)
    for (const method::Value& value : knob.sweep)
      if (value != knob.sweep.front()) settings.push_back({{knob.name, value}});
  return settings;
}

std::vector<method::Setting> descent(std::span<const method::Option> knobs, size_t most,
                                     const std::function<Cost(const method::Setting&)>& cost) {
  constexpr double kLeastGain = 0.02;          // of the work; less is not worth a step
  constexpr double kLeastError = 1e-6;         // so that steps without any error are ranked by work
  std::vector<size_t> places(knobs.size(), 0); // in Option::sweep
  const auto settingAt = [&](const std::vector<size_t>& at) {
    method::Setting setting;
    for (size_t k = 0; k < knobs.size(); ++k) setting[knobs[k].name] = knobs[k].sweep[at[k]];
    return withoutFull(knobs, std::move(setting));
  };
  std::vector<method::Setting> path;
  Cost here = cost({});
  while (path.size() < most) {
    struct Step {
      size_t knob;
      Cost cost;
      double worth;
    };
    std::optional<Step> best;
    for (size_t k = 0; k < knobs.size(); ++k) {
      if (places[k] + 1 == knobs[k].sweep.size()) continue;
      std::vector<size_t> next = places;
      ++next[k];
      const Cost there = cost(settingAt(next));
      const double gain = here.work - there.work;
      if (gain < kLeastGain * here.work) continue;
      const double worth = gain / std::max(there.error - here.error, kLeastError);
      if (!best || worth > best->worth) best = Step{k, there, worth};
    }
    if (!best) break;
    ++places[best->knob];
    here = best->cost;
    path.push_back(settingAt(places));
  }
  return path;
}

size_t longestDescent(std::span<const method::Option> knobs, size_t most) {
  size_t steps = 0;
  for (const method::Option& knob : knobs) steps += knob.sweep.size() - 1;
  return std::min(steps, most);
}

} // namespace surflect::chart
