// Knobs that count: the terms of light field maps, and others.
#pragma once

#include "render/knobs/knob.h"

#include <cstddef>

namespace surflect::lfm {

struct CountRange {
  size_t lowest = 0, highest = 0;
};

// A whole number of a setting; `full` if it does not name it. Throws Error for a number that is not whole or
// outside the range.
size_t countOf(const knobs::Setting& setting, const char* name, const CountRange& range, size_t full);

// The knob "terms": from `full` to 0 one by one.
knobs::Knob termsKnob(size_t full);
// Terms of a setting; `full` if it does not name them. Throws Error as countOf() does.
size_t termsOf(const knobs::Setting& setting, size_t full);

} // namespace surflect::lfm
