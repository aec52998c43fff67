// Knobs whose values are whole numbers, such as the number of terms of light field maps.
#pragma once

#include "render/knobs/knob.h"

#include <cstddef>

namespace surflect::lfm {

struct CountRange {
  size_t lowest = 0, highest = 0;
};

// Value of a knob in a setting, a whole number; `full` if the setting does not name the knob. Throws Error
// for a number that is not whole or outside the range.
size_t countOf(const knobs::Setting& setting, const char* name, const CountRange& range, size_t full);

// The knob "terms": from `full` to 0 one by one.
knobs::Knob termsKnob(size_t full);
// Number of terms in a setting; `full` if the setting does not name it. Throws Error as countOf() does.
size_t termsOf(const knobs::Setting& setting, size_t full);

} // namespace surflect::lfm
