#include "render/chart/settings.h"

#include <algorithm>
#include <optional>

namespace surflect::chart {

knobs::Setting withoutFull(std::span<const knobs::Knob> knobs, knobs::Setting setting) {
  for (const knobs::Knob& knob : knobs) {
    const auto found = setting.find(knob.name);
    if (found != setting.end() && found->second == knob.values.front()) setting.erase(found);
  }
  return setting;
}

std::vector<knobs::Setting> combinations(std::span<const knobs::Knob> knobs) {
  std::vector<knobs::Setting> settings{{}};
  for (const knobs::Knob& knob : knobs) {
    std::vector<knobs::Setting> longer;
    for (const knobs::Setting& setting : settings)
      for (const double value : knob.values) {
        longer.push_back(setting);
        longer.back()[knob.name] = value;
      }
    settings = std::move(longer);
  }
  return settings;
}

std::vector<knobs::Setting> oneByOne(std::span<const knobs::Knob> knobs) {
  std::vector<knobs::Setting> settings{{}};
  for (const knobs::Knob& knob : knobs)
    for (const double value : knob.values)
      if (value != knob.values.front()) settings.push_back({{knob.name, value}});
  return settings;
}

std::vector<knobs::Setting> descent(std::span<const knobs::Knob> knobs, size_t most,
                                    const std::function<Cost(const knobs::Setting&)>& cost) {
  constexpr double kLeastGain = 0.02;          // of the work; less is not worth a step
  constexpr double kLeastError = 1e-6;         // so that steps without any error are ranked by work
  std::vector<size_t> places(knobs.size(), 0); // in Knob::values
  const auto settingAt = [&](const std::vector<size_t>& at) {
    knobs::Setting setting;
    for (size_t k = 0; k < knobs.size(); ++k) setting[knobs[k].name] = knobs[k].values[at[k]];
    return withoutFull(knobs, std::move(setting));
  };
  std::vector<knobs::Setting> path;
  Cost here = cost({});
  while (path.size() < most) {
    struct Step {
      size_t knob;
      Cost cost;
      double worth;
    };
    std::optional<Step> best;
    for (size_t k = 0; k < knobs.size(); ++k) {
      if (places[k] + 1 == knobs[k].values.size()) continue;
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

size_t longestDescent(std::span<const knobs::Knob> knobs, size_t most) {
  size_t steps = 0;
  for (const knobs::Knob& knob : knobs) steps += knob.values.size() - 1;
  return std::min(steps, most);
}

} // namespace surflect::chart
