#include "render/lightfield/lfm/terms_knob.h"

#include "surfel/base/error.h"

#include <cmath>
#include <string>

namespace surflect::lfm {

size_t countOf(const knobs::Setting& setting, const char* name, const CountRange& range, size_t full) {
  const auto found = setting.find(name);
  if (found == setting.end()) return full;
  const double count = found->second;
  if (!(count >= static_cast<double>(range.lowest) && count <= static_cast<double>(range.highest)) ||
      count != std::floor(count))
    throw Error::mismatch("a whole number of " + std::to_string(range.lowest) + " to " +
                              std::to_string(range.highest),
                          numberText(count))
        .at(name)
        .at("knob");
  return static_cast<size_t>(count);
}

knobs::Knob termsKnob(size_t full) {
  knobs::Knob knob{"terms", "approximation terms that are added to the mean", {}};
  for (size_t k = full + 1; k-- > 0;) knob.values.push_back(static_cast<double>(k));
  return knob;
}

size_t termsOf(const knobs::Setting& setting, size_t full) {
  return countOf(setting, "terms", {0, full}, full);
}

} // namespace surflect::lfm
